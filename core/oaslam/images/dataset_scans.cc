#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "oaslam/formats/colmap_model.h"
#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/dataset_layouts.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/util/bad_input.h"

// Of reconstructions, and of apps that scan with a phone.
namespace oaslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Of the OpenGL camera of ARKit and Nerfstudio (y up, looks along -z) to ours.
Rigid3 FromOpenGl(const Rigid3& pose) {
  const Rigid3 gl_from_cam(Eigen::Matrix3d(Eigen::Vector3d(1, -1, -1).asDiagonal()),
                           Eigen::Vector3d::Zero());
  return pose * gl_from_cam;
}

json ParseObject(const std::string& path) {
  json root = json::parse(ReadTextFile(path), nullptr, false);
  if (!root.is_object()) throw BadInput("{}: is no JSON object", path);
  return root;
}

// A list of `count` numbers, or of lists of them.
std::vector<double> NumbersOf(const json& value, size_t count, const std::string& place) {
  std::vector<double> numbers;
  const auto add = [&](const json& list) {
    for (const json& x : list)
      if (x.is_number()) numbers.push_back(x.get<double>());
  };
  if (value.is_array()) add(value);
  if (value.is_array())
    for (const json& row : value)
      if (row.is_array()) add(row);
  if (numbers.size() < count)
    throw BadInput("{}: {} numbers, expected {}", place, numbers.size(), count);
  return numbers;
}

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
  const std::string camera = folder.First(
      {"sparse/0/cameras.txt", "sparse/0/cameras.bin", "sparse/cameras.txt", "sparse/cameras.bin"});
  if (!folder.Has("images") || camera.empty()) return std::nullopt;
  Dataset dataset;
  dataset.images = ListFolder(folder.At("images"), folder.options);
  dataset.camera = camera;
  const fs::path model = fs::path(camera).parent_path();
  const std::string poses =
      (model / (camera.ends_with(".bin") ? "images.bin" : "images.txt")).string();
  std::error_code error;
  if (!fs::exists(poses, error)) return dataset;
  dataset.truth = [poses, listed = dataset.images] {
    std::map<std::string, Rigid3> known;  // by the path below images/
    for (const ColmapPose& pose : LoadColmapPoses(poses))
      known[pose.name] = pose.cam_from_world.Inverse();
    std::vector<StampedPose> found;
    for (const ListedImage& image : listed)
      if (const auto pose = known.find(BaseName(image.path)); pose != known.end())
        found.push_back({image.timestamp, pose->second});
    return found;
  };
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
  std::map<std::string, Rigid3> poses;
  for (size_t i = 0; i < frames->size(); ++i) {
    const json& frame = (*frames)[i];
    const std::string place = fmt::format("{}: frames[{}]", path, i);
    if (!frame.is_object() || !frame.contains("file_path") || !frame["file_path"].is_string())
      throw BadInput("{}: key file_path is missing", place);
    const std::string image = PathOfFrame(folder, frame["file_path"].get<std::string>());
    dataset.images.push_back({0, image});
    if (const auto matrix = frame.find("transform_matrix"); matrix != frame.end())
      poses[image] = FromOpenGl(PoseOfMatrix(NumbersOf(*matrix, 12, place + ".transform_matrix"),
                                             place + ".transform_matrix"));
  }
  std::ranges::sort(dataset.images, NaturalLess, &ListedImage::path);
  SetTimes(path, folder.options, dataset.images);
  // Those of a file for instant-ngp may have one for each image.
  if (root.contains("fl_x") || root.contains("camera_angle_x")) dataset.camera = path;
  if (!poses.empty())
    dataset.truth = [poses = std::move(poses), listed = dataset.images] {
      std::vector<StampedPose> found;
      for (const ListedImage& image : listed)
        if (const auto pose = poses.find(image.path); pose != poses.end())
          found.push_back({image.timestamp, pose->second});
      return found;
    };
  return dataset;
}

std::optional<Dataset> FindRecord3d(const DatasetFolder& folder) {
  const std::string path = folder.First({"metadata", "metadata.json"});
  if (!folder.Has("rgbd") || path.empty()) return std::nullopt;
  const json root = ParseObject(path);
  ImageSourceOptions options = folder.options;
  if (const auto fps = root.find("fps"); fps != root.end() && fps->is_number() && !options.fps) {
    options.fps = fps->get<double>();
    if (!(*options.fps > 0 && *options.fps <= 10000))
      throw BadInput("{}: fps: {}, allowed: above 0 to 10000", path, *options.fps);
  }
  Dataset dataset;
  dataset.images = ListFolder(folder.At("rgbd"), options);
  if (root.contains("K")) dataset.camera = path;
  const auto poses = root.find("poses");
  if (poses == root.end() || !poses->is_array() || poses->empty()) return dataset;
  dataset.truth = [poses = *poses, path, listed = dataset.images, images = folder.At("rgbd")] {
    CheckCount(path, poses.size(), "poses", images, listed.size());
    std::vector<StampedPose> found;
    for (size_t i = 0; i < poses.size(); ++i) {
      const std::string place = fmt::format("{}: poses[{}]", path, i);
      const std::vector<double> v = NumbersOf(poses[i], 7, place);
      found.push_back({listed[i].timestamp,
                       FromOpenGl(PoseOfQuaternion(Eigen::Quaterniond(v[3], v[0], v[1], v[2]),
                                                   {v[4], v[5], v[6]}, place))});
    }
    return found;
  };
  return dataset;
}

std::optional<Dataset> FindStrayScanner(const DatasetFolder& folder) {
  if (!folder.Has("rgb.mp4") || !folder.Has("camera_matrix.csv")) return std::nullopt;
  Dataset dataset;
  dataset.film = folder.At("rgb.mp4");
  dataset.camera = folder.At("camera_matrix.csv");
  const std::string truth = folder.First({"odometry.csv"});
  if (truth.empty()) return dataset;
  dataset.truth = [truth] {
    std::vector<StampedPose> poses;
    for (const auto& v : LoadColumns(truth, {"timestamp", "x", "y", "z", "qx", "qy", "qz", "qw"})) {
      const std::string place = fmt::format("{}: pose {}", truth, poses.size());
      poses.push_back({v[0], PoseOfQuaternion(Eigen::Quaterniond(v[7], v[4], v[5], v[6]),
                                              {v[1], v[2], v[3]}, place)});
    }
    // The times of a film begin at 0.
    const double first = poses.empty() ? 0 : poses.front().timestamp;
    for (StampedPose& pose : poses) pose.timestamp -= first;
    return poses;
  };
  return dataset;
}

}  // namespace oaslam
