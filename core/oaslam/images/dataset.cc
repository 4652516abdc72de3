#include "oaslam/images/dataset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/dataset_layouts.h"
#include "oaslam/images/image_files.h"
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
constexpr DatasetLayout kLayouts[] = {{"EuRoC", FindEuRoC},
                                      {"KITTI", FindKitti},
                                      {"7-Scenes", FindSevenScenes},
                                      {"ScanNet", FindScanNet},
                                      {"Record3D", FindRecord3d},
                                      {"Stray-Scanner", FindStrayScanner},
                                      {"MARS-Logger", FindMarsLogger},
                                      {"3D-Scanner-App", FindScannerApp},
                                      {"Polycam", FindPolycam},
                                      {"Nerfstudio", FindNerfstudio},
                                      {"COLMAP", FindColmap},
                                      {"TUM", FindTum},
                                      {"ICL-NUIM", FindIclNuim}};

std::optional<Dataset> FindLayout(const DatasetLayout& layout, const DatasetFolder& folder,
                                  bool may_lack_images) {
  std::optional<Dataset> found;
  try {
    found = layout.find(folder);
  } catch (const InputError& error) {
    throw BadInput("{} (the folder is taken for {}; --dataset none: for its images alone)",
                   error.what(), layout.name);
  }
  if (!found) return std::nullopt;
  found->layout = layout.name;
  const bool has_images = !found->film.empty() || !found->images.empty();
  if (has_images) return found;
  if (!found->named_truth)
    throw BadInput("{}: in the layout of {}, but no images", folder.root, layout.name);
  return may_lack_images ? found : std::nullopt;
}

std::optional<Dataset> Find(const std::string& folder, const ImageSourceOptions& options,
                            bool may_lack_images) {
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
    if (std::optional<Dataset> found = FindLayout(layout, {folder, options}, may_lack_images))
      return found;
  }
  if (!asked.empty())
    throw BadInput("{}: --dataset {}: is no folder in that layout (docs/formats.md)", folder,
                   options.dataset);
  return std::nullopt;
}

// Names without their extension; which of two of the same name is meant is not known.
template <typename Named>
std::map<std::string, size_t> IndexByName(const std::vector<Named>& all, std::string Named::*name,
                                          const std::string& path) {
  std::map<std::string, size_t> index;
  for (size_t i = 0; i < all.size(); ++i)
    if (const auto [other, is_new] = index.emplace(WithoutExtension(BaseName(all[i].*name)), i);
        !is_new && all[i].*name != all[other->second].*name)
      throw BadInput("{}: two images have the name {}: {} and {}; give one recording alone", path,
                     Quoted(other->first), all[other->second].*name, all[i].*name);
  return index;
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

std::optional<DepthFiles> DatasetFolder::Depths(const char* folder, const char* confidence,
                                                double unit) const {
  std::error_code error;
  if (!fs::is_directory(At(folder), error) || ImageNames(At(folder)).empty()) return std::nullopt;
  DepthFiles found = LoadDepthFiles(At(folder), unit);
  if (Has(confidence)) found.confidence = At(confidence);
  return found;
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

Rigid3 FromOpenGl(const Rigid3& pose) {
  const Rigid3 gl_from_cam(Eigen::Matrix3d(Eigen::Vector3d(1, -1, -1).asDiagonal()),
                           Eigen::Vector3d::Zero());
  return pose * gl_from_cam;
}

nlohmann::json ParseObject(const std::string& path) {
  nlohmann::json root = nlohmann::json::parse(ReadTextFile(path), nullptr, false);
  if (!root.is_object()) throw BadInput("{}: is no JSON object", path);
  return root;
}

std::vector<double> NumbersOf(const nlohmann::json& value, size_t count, const std::string& place) {
  std::vector<double> numbers;
  const auto add = [&](const nlohmann::json& list) {
    for (const nlohmann::json& x : list)
      if (x.is_number()) numbers.push_back(x.get<double>());
  };
  if (value.is_array()) add(value);
  if (value.is_array())
    for (const nlohmann::json& row : value)
      if (row.is_array()) add(row);
  if (numbers.size() < count)
    throw BadInput("{}: {} numbers, expected {}", place, numbers.size(), count);
  return numbers;
}

void SetNamedTruth(std::function<std::vector<NamedPose>()> poses, bool has_times,
                   Dataset& dataset) {
  dataset.truth = [poses, listed = dataset.images] {
    std::map<std::string, Rigid3> known;
    for (const NamedPose& pose : poses()) known[pose.name] = pose.world_from_cam;
    std::vector<StampedPose> found;
    for (const ListedImage& image : listed)
      if (const auto pose = known.find(image.path); pose != known.end())
        found.push_back({image.timestamp, pose->second});
    return found;
  };
  if (!has_times) dataset.named_truth = std::move(poses);
}

std::vector<std::string> DatasetLayouts() {
  std::vector<std::string> names;
  for (const DatasetLayout& layout : kLayouts) names.emplace_back(layout.name);
  return names;
}

std::optional<Dataset> FindDataset(const std::string& folder, const ImageSourceOptions& options) {
  return Find(folder, options, false);
}

std::optional<Dataset> FindTruth(const std::string& folder, const ImageSourceOptions& options) {
  return Find(folder, options, true);
}

std::vector<StampedPose> AtTimesOf(const std::vector<ListedImage>& images,
                                   const std::vector<NamedPose>& poses, const std::string& path) {
  const auto at = IndexByName(images, &ListedImage::path, path);
  std::vector<StampedPose> found;
  for (const auto& [name, i] : IndexByName(poses, &NamedPose::name, path))
    if (const auto image = at.find(name); image != at.end())
      found.push_back({images[image->second].timestamp, poses[i].world_from_cam});
  if (found.empty() && !images.empty() && !poses.empty())
    throw BadInput(
        "{}: none of its {} images is one of the {} of the estimate, by name: it has {}, those {}",
        path, poses.size(), images.size(), Quoted(BaseName(poses.front().name)),
        Quoted(BaseName(images.front().path)));
  std::ranges::sort(found, {}, &StampedPose::timestamp);
  return found;
}

FilmSource FilmOf(const std::string& source, const ImageSourceOptions& options) {
  const std::optional<Dataset> dataset = FindDataset(source, options);
  if (!dataset || dataset->film.empty()) return {source, {}};
  return {dataset->film, dataset->film_times};
}

}  // namespace oaslam
