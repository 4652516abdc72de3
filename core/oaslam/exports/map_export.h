#pragma once

#include <map>
#include <string>

#include "oaslam/export_map.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/image_source.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {

// Exports to files of other tools (docs/export.md has an example of each, with its frame of
// reference and pixel coordinates). Each throws InputError when its file cannot be written.

// The format of this name (ToString). Throws InputError where there is none.
MapFormat MapFormatOf(const std::string& name);
// Whether a path becomes a folder in this format, which for kTum has a file of each recording.
bool IsFolder(const SavedMap& saved, MapFormat format, const std::string& path);

// As ExportMap of export_map.h. `range`: which images of the sources belong to the map.
void ExportMap(const SavedMap& saved, MapFormat format, const std::string& path,
               const ExportOptions& options, const ImageSourceOptions& range);

// Landmarks as coloured points; with `ellipsoids`, the mapped objects as triangles too. Frame of
// the map.
void ExportPly(const std::string& path, const SavedMap& saved, bool ellipsoids);

// Ellipsoids as meshes, landmarks as points, trajectory and camera frusta as lines; right-handed, y
// up. glTF 2.0 in one file, as text (.gltf) or binary (.glb) by the extension.
void ExportGltf(const std::string& path, const SavedMap& saved);

// Final poses of all frames; of the keyframes where the map has no trajectory. The times of several
// recordings must not overlap.
void ExportTum(const std::string& path, const SavedMap& saved);
// Writes the same poses, one file for each recording (FileNameOf, .txt).
void ExportTumFiles(const std::string& folder, const SavedMap& saved);

// The map as messages of ROS 2 (docs/robots.md): landmarks, objects, and of each recording its path
// and the transforms of its camera.
void ExportMcap(const std::string& path, const SavedMap& saved);

struct KeyframeImage {
  std::string name;  // as in image databases: relative to the folder of the images
  std::string path;  // path of the file, relative to the exported folder
};
using KeyframeImages = std::map<KeyframeId, KeyframeImage>;

// Makes names for the keyframe images where no images are given: time stamps, such as
// 1341847980.722988.png, in images/ of the exported folder. Where there are several recordings,
// each has a folder there (FileNameOf).
KeyframeImages ImagesByTime(const SavedMap& saved);
// Finds the images of each recording's source (OpenImages) whose time stamps are those of its
// keyframes. Images of a video, and rotated ones, are written to images/ of `folder`; of several
// recordings each has a folder there, or a link to its images. Keyframes without an image are left
// out, with a warning. Throws InputError when no keyframe of a recording has an image, or two have
// the same time.
KeyframeImages FindImages(const SavedMap& saved, const std::vector<std::string>& sources,
                          const ImageSourceOptions& options, const std::string& folder);

// The mean colour of the pixels that show each landmark, in those of the images that exist; grey
// for the others.
std::map<LandmarkId, Rgb> ColorsOfLandmarks(const Map& map, const KeyframeImages& images,
                                            const std::string& folder);

// Writes cameras.txt, images.txt and points3D.txt to `folder`. Key points are in (distorted) pixels
// of the camera model that is written there.
void ExportColmap(const std::string& folder, const SavedMap& saved, const KeyframeImages& images);

// Writes transforms.json and sparse_pc.ply to `folder`: OpenGL camera axes, a world with z up.
void ExportNerfstudio(const std::string& folder, const SavedMap& saved,
                      const KeyframeImages& images);

}  // namespace oaslam
