#pragma once

#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/map_snapshot.h"

namespace oaslam {

// Formats of other tools; docs/export.md has an example of each, with its frame of reference and
// its pixel coordinates. kPly: a cloud of coloured points; kGltf: ellipsoids, landmarks, camera
// path (.gltf as text, .glb in binary); kTum: the trajectory, or the poses of the keyframes where
// the map has no trajectory; kColmap, kNerfstudio: a folder with cameras, poses and points; kMcap:
// a recording of ROS 2 (docs/robots.md).
enum class MapFormat { kPly, kGltf, kTum, kColmap, kNerfstudio, kMcap };
// "ply", "gltf", "tum", "colmap", "nerfstudio", "mcap".
OASLAM_API const char* ToString(MapFormat format);

// What a format may contain besides.
struct ExportOptions {
  bool with_ellipsoids = false;  // kPly: the objects as triangles, too
  // kColmap, kNerfstudio: the images of the map, a source (OpenImages) for each of its recordings.
  // Empty: keyframes are named by their time stamps, and no image is read.
  std::vector<std::string> images{};
};
// Writes a map to a file, or to a folder where the format wants one:
//
//   ExportMap(slam.WholeMap(), MapFormat::kGltf, "room.glb");
//
// kTum writes one file for all recordings; where their times overlap, `path` must name a folder,
// which has no extension and gets a file of each. Throws InputError for a map without keyframes, a
// file name whose extension is not that of the format, another number of `images` than of
// recordings, images that cannot be read, and a file that cannot be written. Then a folder may have
// a part of its files.
OASLAM_API void ExportMap(const MapSnapshot& map, MapFormat format, const std::string& path,
                          const ExportOptions& options = {});

}  // namespace oaslam
