#pragma once

#include <map>
#include <optional>
#include <string>

#include "oaslam/exports/map_scene.h"
#include "oaslam/images/image_source.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {

// Files of other tools (docs/export.md has an example of each, with its frame of reference and
// pixel coordinates). Each throws InputError when its file cannot be written.

// Landmarks as coloured points; with `ellipsoids`, the mapped objects as triangles too. Frame of
// the map.
void ExportPly(const std::string& path, const SavedMap& saved, bool ellipsoids);

// Ellipsoids as meshes, landmarks as points, trajectory and camera frusta as lines; right-handed, y
// up. OBJ with its materials beside it; glTF 2.0 in one file, as text (.gltf) or binary (.glb) by
// the extension.
void ExportObj(const std::string& path, const SavedMap& saved);
void ExportGltf(const std::string& path, const SavedMap& saved);

// Final poses of all frames; of the keyframes where the map has no trajectory.
void ExportTum(const std::string& path, const SavedMap& saved);

// What the map knows of the world, without what only the system needs to go on (docs/export.md
// lists it).
void ExportJson(const std::string& path, const SavedMap& saved);

// The image of a keyframe.
struct KeyframeImage {
  std::string name;  // as image databases know it: relative to the folder of the images
  std::string path;  // of the file, relative to the exported folder
};
using KeyframeImages = std::map<KeyframeId, KeyframeImage>;

// Without the images: named by their time stamp, 1341847980.722988.png, in images/ of the exported
// folder.
KeyframeImages ImagesByTime(const Map& map);
// The images of `source` (OpenImages) whose time stamps are the keyframes'; those of a video, and
// all where they are to be upright, are written to images/ of `folder`. Keyframes without an image
// stay out, with a warning. Throws InputError when none has one, or two keyframes have one time.
KeyframeImages FindImages(const Map& map, const std::string& source,
                          const ImageSourceOptions& options, const std::string& folder);

// The mean colour of the pixels where each landmark was seen, from those of the images that are
// there; grey for the others.
std::map<LandmarkId, Rgb> LandmarkColors(const Map& map, const KeyframeImages& images,
                                         const std::string& folder);

// cameras.txt, images.txt and points3D.txt in `folder`. Key points are in the (distorted) pixels of
// the camera model written there.
void ExportColmap(const std::string& folder, const SavedMap& saved, const KeyframeImages& images);

// transforms.json and sparse_pc.ply in `folder`: OpenGL camera axes, a world with z up.
void ExportNerfstudio(const std::string& folder, const SavedMap& saved,
                      const KeyframeImages& images);

}  // namespace oaslam
