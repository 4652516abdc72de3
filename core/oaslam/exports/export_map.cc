#include "oaslam/export_map.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <system_error>

#include "oaslam/exports/map_export.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/named.h"

namespace oaslam {
namespace {

constexpr Named<MapFormat> kFormats[] = {{MapFormat::kPly, "ply"},
                                         {MapFormat::kGltf, "gltf"},
                                         {MapFormat::kTum, "tum"},
                                         {MapFormat::kColmap, "colmap"},
                                         {MapFormat::kNerfstudio, "nerfstudio"},
                                         {MapFormat::kMcap, "mcap"}};

void CheckExtension(MapFormat format, const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (format == MapFormat::kGltf && extension != ".gltf" && extension != ".glb")
    throw InputError(path + ": glTF is a file .gltf (text) or .glb (binary)");
  if (format == MapFormat::kPly && extension != ".ply")
    throw InputError(path + ": PLY is a file .ply");
  if (format == MapFormat::kMcap && extension != ".mcap")
    throw InputError(path + ": MCAP is a file .mcap");
}

void MakeFolder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw BadInput("{}: cannot be made: {}", path, error.message());
}

}  // namespace

const char* ToString(MapFormat format) { return NameIn(kFormats, format); }

MapFormat MapFormatOf(const std::string& name) {
  const std::optional<MapFormat> format = ValueIn(kFormats, name);
  if (!format) throw InputError(name + ": no format of maps");
  return *format;
}

bool IsFolder(const SavedMap& saved, MapFormat format, const std::string& path) {
  if (format == MapFormat::kTum)
    return saved.recordings.size() > 1 &&
           (std::filesystem::is_directory(path) || !std::filesystem::path(path).has_extension());
  return format == MapFormat::kColmap || format == MapFormat::kNerfstudio;
}

void ExportMap(const SavedMap& saved, MapFormat format, const std::string& path,
               const ExportOptions& options, const ImageSourceOptions& range) try {
  if (saved.map.keyframes.empty()) throw InputError(path + ": the map to be exported is empty");
  if (std::ranges::find(kFormats, format, &Named<MapFormat>::value) == std::end(kFormats))
    throw BadInput("format {}: allowed: 0 to {}", static_cast<int>(format),
                   std::size(kFormats) - 1);
  CheckExtension(format, path);
  if (format == MapFormat::kPly) return ExportPly(path, saved, options.with_ellipsoids);
  if (format == MapFormat::kGltf) return ExportGltf(path, saved);
  if (format == MapFormat::kMcap) return ExportMcap(path, saved);
  if (!IsFolder(saved, format, path)) return ExportTum(path, saved);
  const size_t recordings = std::max<size_t>(1, saved.recordings.size());
  if (!options.images.empty() && options.images.size() != recordings)
    throw BadInput("{}: {} sources of images for a map of {} recordings", path,
                   options.images.size(), recordings);
  MakeFolder(path);
  if (format == MapFormat::kTum) return ExportTumFiles(path, saved);
  ImageSourceOptions color = range;
  color.color = true;
  const KeyframeImages images =
      options.images.empty() ? ImagesByTime(saved) : FindImages(saved, options.images, color, path);
  if (format == MapFormat::kColmap) return ExportColmap(path, saved, images);
  ExportNerfstudio(path, saved, images);
} catch (const std::filesystem::filesystem_error& error) {
  throw InputError(error.what());
}

void ExportMap(const MapSnapshot& map, MapFormat format, const std::string& path,
               const ExportOptions& options) {
  ExportMap(SavedMapOf(map), format, path, options, {});
}

}  // namespace oaslam
