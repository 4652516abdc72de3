#include "oaslam/images/dataset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "oaslam/formats/pose_values.h"
#include "oaslam/images/dataset_layouts.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

struct DatasetLayout {
  const char* name;
  std::optional<Dataset> (*find)(const DatasetFolder&);
};
// One with more files of its own stands before one that it may contain.
constexpr DatasetLayout kLayouts[] = {
    {"EuRoC", FindEuRoC},           {"KITTI", FindKitti},       {"7-Scenes", FindSevenScenes},
    {"ScanNet", FindScanNet},       {"Record3D", FindRecord3d}, {"Stray-Scanner", FindStrayScanner},
    {"Nerfstudio", FindNerfstudio}, {"COLMAP", FindColmap},     {"TUM", FindTum},
    {"ICL-NUIM", FindIclNuim}};

std::optional<Dataset> FindLayout(const DatasetLayout& layout, const DatasetFolder& folder) {
  std::optional<Dataset> found;
  try {
    found = layout.find(folder);
  } catch (const InputError& error) {
    throw BadInput("{} (the folder is taken for {}; --dataset none: for its images alone)",
                   error.what(), layout.name);
  }
  if (!found) return std::nullopt;
  found->layout = layout.name;
  if (found->film.empty() && found->images.empty())
    throw BadInput("{}: in the layout of {}, but no images", folder.root, layout.name);
  return found;
}

}  // namespace

std::string DatasetFolder::At(const std::string& path) const {
  return (fs::path(root) / path).string();
}

bool DatasetFolder::Has(const std::string& path) const {
  std::error_code error;
  return fs::exists(At(path), error);
}

std::string DatasetFolder::First(std::initializer_list<const char*> paths) const {
  for (const char* path : paths)
    if (Has(path)) return At(path);
  return "";
}

Rigid3 PoseOfMatrix(const std::vector<double>& rows, const std::string& place) {
  const std::optional<Rigid3> pose = PoseOfRows(rows);
  if (!pose) throw BadInput("{}: is no rotation and translation", place);
  return *pose;
}

void CheckCount(const std::string& path, size_t count, const char* what, const std::string& folder,
                size_t images) {
  if (count != images)
    throw BadInput("{}: {} {}, but {} has {} images", path, count, what, folder, images);
}

std::vector<std::string> DatasetLayouts() {
  std::vector<std::string> names;
  for (const DatasetLayout& layout : kLayouts) names.emplace_back(layout.name);
  return names;
}

std::optional<Dataset> FindDataset(const std::string& folder, const ImageSourceOptions& options) {
  std::error_code error;
  const std::string asked = Lower(options.dataset);
  if (asked == "none" || options.follow) return std::nullopt;
  if (!asked.empty() && std::ranges::none_of(kLayouts, [&](const DatasetLayout& layout) {
        return Lower(layout.name) == asked;
      }))
    throw BadInput("--dataset {}: allowed: {} | none", options.dataset,
                   fmt::join(DatasetLayouts(), " | "));
  const bool is_folder = fs::is_directory(folder, error);
  for (const DatasetLayout& layout : kLayouts) {
    if (!is_folder || (!asked.empty() && asked != Lower(layout.name))) continue;
    if (std::optional<Dataset> found = FindLayout(layout, {folder, options})) return found;
  }
  if (!asked.empty())
    throw BadInput("{}: --dataset {}: is no folder in that layout (docs/formats.md)", folder,
                   options.dataset);
  return std::nullopt;
}

std::string FilmOf(const std::string& source, const ImageSourceOptions& options) {
  const std::optional<Dataset> dataset = FindDataset(source, options);
  return dataset && !dataset->film.empty() ? dataset->film : source;
}

}  // namespace oaslam
