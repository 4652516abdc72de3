#include "oaslam/export_map.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include "oaslam/exports/map_export.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

void CheckExtension(MapFormat format, const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (format == MapFormat::kGltf && extension != ".gltf" && extension != ".glb")
    throw InputError(path + ": glTF is a file .gltf (text) or .glb (binary)");
  if (format == MapFormat::kPly && extension != ".ply")
    throw InputError(path + ": PLY is a file .ply");
}

void MakeFolder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw BadInput("{}: cannot be made: {}", path, error.message());
}

}  // namespace

const char* ToString(MapFormat format) {
  return std::to_array<const char*>(
      {"ply", "gltf", "tum", "colmap", "nerfstudio"})[static_cast<size_t>(format)];
}

void ExportMap(const SavedMap& saved, MapFormat format, const std::string& path,
               const ExportOptions& options, const ImageSourceOptions& range) {
  if (saved.map.keyframes.empty()) throw InputError(path + ": the map to be exported is empty");
  CheckExtension(format, path);
  if (format == MapFormat::kPly) return ExportPly(path, saved, options.with_ellipsoids);
  if (format == MapFormat::kGltf) return ExportGltf(path, saved);
  if (format == MapFormat::kTum) return ExportTum(path, saved);
  const size_t recordings = std::max<size_t>(1, saved.recordings.size());
  if (!options.images.empty() && options.images.size() != recordings)
    throw BadInput("{}: {} sources of images for a map of {} recordings", path,
                   options.images.size(), recordings);
  MakeFolder(path);
  ImageSourceOptions color = range;
  color.color = true;
  const KeyframeImages images =
      options.images.empty() ? ImagesByTime(saved) : FindImages(saved, options.images, color, path);
  if (format == MapFormat::kColmap) return ExportColmap(path, saved, images);
  ExportNerfstudio(path, saved, images);
}

void ExportMap(const MapSnapshot& map, MapFormat format, const std::string& path,
               const ExportOptions& options) {
  ExportMap(SavedMapOf(map), format, path, options, {});
}

}  // namespace oaslam
