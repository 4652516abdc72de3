#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "oaslam/formats/colmap_model.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/dataset_layouts.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/util/bad_input.h"

// Of reconstructions.
namespace oaslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A path in a transforms.json, such as "./images/0001", which may lack the extension.
std::string PathOfFrame(const DatasetFolder& folder, const std::string& given) {
  const std::string path = fs::path(given).lexically_normal().string();
  if (folder.Has(path)) return folder.At(path);
  for (const char* extension : {".png", ".jpg"})
    if (folder.Has(path + extension)) return folder.At(path + extension);
  return folder.At(path);
}

}  // namespace

std::optional<Dataset> FindColmap(const DatasetFolder& folder) {
  std::string camera = folder.First({"sparse/0/cameras.txt", "sparse/0/cameras.bin",
                                     "sparse/cameras.txt", "sparse/cameras.bin",
                                     "colmap/sparse/0/cameras.txt", "colmap/sparse/0/cameras.bin"});
  const bool is_root = camera.empty() && !folder.First({"images.txt", "images.bin"}).empty();
  if (is_root) camera = folder.First({"cameras.txt", "cameras.bin"});
  if (camera.empty()) return std::nullopt;
  const fs::path model = fs::path(camera).parent_path();
  const std::string poses =
      (model / (camera.ends_with(".bin") ? "images.bin" : "images.txt")).string();
  const std::string images = folder.Has("images") ? folder.At("images") : folder.root;
  Dataset dataset;
  dataset.camera = camera;
  ImageSourceOptions quiet = folder.options;
  quiet.quiet = true;
  dataset.images = ListFolder(images, quiet);
  // Without its folder of images a model is only a ground truth; other images are not its own.
  if (!folder.Has("images") && !is_root && !dataset.images.empty()) return std::nullopt;
  std::error_code error;
  const auto read = [poses, images] {
    std::vector<NamedPose> found;
    for (const ColmapPose& pose : LoadColmapPoses(poses))
      found.push_back({(fs::path(images) / pose.name).string(), pose.cam_from_world.Inverse()});
    return found;
  };
  if (!fs::exists(poses, error)) return dataset;
  if (dataset.images.empty()) {  // in folders below
    for (const NamedPose& pose : read())
      if (fs::exists(pose.name, error)) dataset.images.push_back({0, pose.name});
    std::ranges::sort(dataset.images, NaturalLess, &ListedImage::path);
  }
  SetNamedTruth(read, SetTimes(images, folder.options, dataset.images), dataset);
  return dataset;
}

std::optional<Dataset> FindNerfstudio(const DatasetFolder& folder) {
  const std::string path = folder.At("transforms.json");
  if (!folder.Has("transforms.json")) return std::nullopt;
  const json root = ParseObject(path);
  const auto frames = root.find("frames");
  if (frames == root.end() || !frames->is_array())
    throw BadInput("{}: key frames is missing, expected a list", path);
  Dataset dataset;
  std::vector<NamedPose> poses;
  bool has_cameras = !frames->empty();
  for (size_t i = 0; i < frames->size(); ++i) {
    const json& frame = (*frames)[i];
    const std::string place = fmt::format("{}: frames[{}]", path, i);
    if (!frame.is_object() || !frame.contains("file_path") || !frame["file_path"].is_string())
      throw BadInput("{}: key file_path is missing", place);
    const std::string image = PathOfFrame(folder, frame["file_path"].get<std::string>());
    dataset.images.push_back({0, image});
    if (const auto matrix = frame.find("transform_matrix"); matrix != frame.end())
      poses.push_back(
          {image, FromOpenGl(PoseOfMatrix(NumbersOf(*matrix, 12, place + ".transform_matrix"),
                                          place + ".transform_matrix"))});
    has_cameras = has_cameras && frame.contains("fl_x");
  }
  std::ranges::sort(dataset.images, NaturalLess, &ListedImage::path);
  const bool has_times = SetTimes(path, folder.options, dataset.images);
  if (root.contains("fl_x") || root.contains("camera_angle_x") || has_cameras)
    dataset.camera = path;
  if (!poses.empty())
    SetNamedTruth([poses = std::move(poses)] { return poses; }, has_times, dataset);
  return dataset;
}

}  // namespace oaslam
