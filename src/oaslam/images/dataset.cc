#include "oaslam/images/dataset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "oaslam/error.h"
#include "oaslam/formats/colmap_model.h"
#include "oaslam/formats/imu_file.h"
#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct DatasetFolder {
  std::string root;
  ImageSourceOptions options;

  std::string At(const std::string& path) const { return (fs::path(root) / path).string(); }
  bool Has(const std::string& path) const {
    std::error_code error;
    return fs::exists(At(path), error);
  }
  // The path of the first of these that is there; empty: none.
  std::string First(std::initializer_list<const char*> paths) const {
    for (const char* path : paths)
      if (Has(path)) return At(path);
    return "";
  }
};

// Of the OpenGL camera of ARKit and Nerfstudio (y up, looks along -z) to ours.
Rigid3 FromOpenGl(const Rigid3& pose) {
  const Rigid3 gl_from_cam(Eigen::Matrix3d(Eigen::Vector3d(1, -1, -1).asDiagonal()),
                           Eigen::Vector3d::Zero());
  return pose * gl_from_cam;
}

// `place` is for messages.
Rigid3 PoseOfMatrix(const std::vector<double>& rows, const std::string& place) {
  const std::optional<Rigid3> pose = PoseOfRows(rows);
  if (!pose) throw InputError(fmt::format("{}: is no rotation and translation", place));
  return *pose;
}

// The matrix in a file of its own, of three rows or four; nothing where there is no file or, as
// ScanNet marks what it does not know, a number that is not finite.
std::optional<Rigid3> LoadMatrix(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return std::nullopt;
  const std::string text = ReadTextFile(path);
  std::vector<double> rows;
  size_t number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++number;
    const auto fields = SplitFields(line);
    if (fields.empty() || rows.size() == 12) continue;
    for (size_t i = 0; i < 4; ++i) {
      const std::string word = i < fields.size() ? Lower(fields[i]) : "";
      if (word.ends_with("inf") || word.ends_with("nan")) return std::nullopt;
      rows.push_back(NumberAt(fields, i, path, number));
    }
  }
  if (rows.size() < 12)
    throw InputError(fmt::format("{}: {} numbers, expected a matrix of 4 x 4", path, rows.size()));
  return PoseOfMatrix(rows, path);
}

// The poses of images that have one in the file of this path each.
template <typename PathOf>
std::vector<StampedPose> LoadMatrices(const std::vector<ListedImage>& images, PathOf path_of) {
  std::vector<StampedPose> poses;
  for (const ListedImage& image : images)
    if (const auto pose = LoadMatrix(path_of(image.path)))
      poses.push_back({image.timestamp, *pose});
  return poses;
}

void CheckCount(const std::string& path, size_t count, const char* what, const std::string& folder,
                size_t images) {
  if (count != images)
    throw InputError(
        fmt::format("{}: {} {}, but {} has {} images", path, count, what, folder, images));
}

json ParseObject(const std::string& path) {
  json root = json::parse(ReadTextFile(path), nullptr, false);
  if (!root.is_object()) throw InputError(fmt::format("{}: is no JSON object", path));
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
    throw InputError(fmt::format("{}: {} numbers, expected {}", place, numbers.size(), count));
  return numbers;
}

std::optional<Dataset> FindEuRoC(const DatasetFolder& given) {
  const DatasetFolder folder{given.Has("mav0") ? given.At("mav0") : given.root, given.options};
  if (!folder.Has("cam0/data.csv")) return std::nullopt;
  Dataset dataset;
  dataset.images = ReadList(folder.At("cam0/data.csv"), folder.options);
  dataset.camera = folder.First({"cam0/sensor.yaml"});
  dataset.imu = folder.First({"imu0/data.csv"});
  const std::string truth =
      folder.First({"state_groundtruth_estimate0/data.csv", "mocap0/data.csv"});
  if (truth.empty()) return dataset;
  dataset.truth = [truth, camera = dataset.camera] {
    const Rigid3 body_from_cam =
        (camera.empty() ? std::nullopt : LoadBodyFromCamera(camera)).value_or(Rigid3());
    std::vector<StampedPose> poses = LoadTrajectory(truth);
    for (StampedPose& pose : poses) pose.world_from_cam = pose.world_from_cam * body_from_cam;
    return poses;
  };
  return dataset;
}

std::optional<Dataset> FindTum(const DatasetFolder& folder) {
  if (!folder.Has("rgb.txt")) return std::nullopt;
  Dataset dataset;
  dataset.images = ReadList(folder.At("rgb.txt"), folder.options);
  if (const std::string truth = folder.First({"groundtruth.txt"}); !truth.empty())
    dataset.truth = [truth] { return LoadTrajectory(truth); };
  return dataset;
}

// Poses are twelve numbers a line; "poses/07.txt" of the benchmark is that of "sequences/07".
std::string KittiPoses(const DatasetFolder& folder) {
  const fs::path root = fs::absolute(fs::path(folder.root) / ".").lexically_normal().parent_path();
  const std::string beside = "../../poses/" + root.filename().string() + ".txt";
  return folder.First({"poses.txt", beside.c_str()});
}

std::optional<Dataset> FindKitti(const DatasetFolder& folder) {
  const std::string images = folder.First({"image_0", "image_2"}), times = folder.At("times.txt");
  if (images.empty() || !folder.Has("times.txt")) return std::nullopt;
  Dataset dataset;
  dataset.images = ListFolder(images, folder.options);
  if (dataset.images.empty()) return dataset;
  const auto seconds = LoadNumberRows(times, 1);
  CheckCount(times, seconds.size(), "times", images, dataset.images.size());
  for (size_t i = 0; i < seconds.size() && !folder.options.fps; ++i)
    dataset.images[i].timestamp = seconds[i][0];
  dataset.camera = folder.First({"calib.txt"});
  const std::string truth = KittiPoses(folder);
  if (truth.empty()) return dataset;
  dataset.truth = [truth, images, listed = dataset.images] {
    const auto rows = LoadNumberRows(truth, 12);
    CheckCount(truth, rows.size(), "poses", images, listed.size());
    std::vector<StampedPose> poses;
    for (size_t i = 0; i < rows.size(); ++i)
      poses.push_back(
          {listed[i].timestamp, PoseOfMatrix(rows[i], fmt::format("{}: pose {}", truth, i))});
    return poses;
  };
  return dataset;
}

std::optional<Dataset> FindSevenScenes(const DatasetFolder& folder) {
  if (folder.First({"frame-000000.color.png", "frame-000000.color.jpg"}).empty()) {
    if (folder.Has("seq-01") && folder.Has("TrainSplit.txt"))
      throw InputError(
          fmt::format("{}: a scene of 7-Scenes, expected one of its sequences, such as {}",
                      folder.root, folder.At("seq-01")));
    return std::nullopt;
  }
  Dataset dataset;
  dataset.images = ListFolder(folder.root, folder.options, ".color");
  if (folder.Has("frame-000000.pose.txt"))
    dataset.truth = [listed = dataset.images] {
      return LoadMatrices(listed, [](const std::string& path) {
        return WithoutExtension(WithoutExtension(path)) + ".pose.txt";
      });
    };
  return dataset;
}

// The number that a name is; nothing for another name.
std::optional<double> NumberOfName(const std::string& path) {
  return ParseNumber(WithoutExtension(BaseName(path)));
}

// Its poses count images, as the names do.
std::optional<Dataset> FindIclNuim(const DatasetFolder& folder) {
  if (!folder.Has("associations.txt") || !folder.Has("rgb")) return std::nullopt;
  std::error_code error;
  std::string truth;
  for (const auto& entry : fs::directory_iterator(folder.root, error))
    if (std::string path = entry.path().string();
        path.ends_with(".gt.freiburg") && (truth.empty() || path < truth))
      truth = std::move(path);
  if (truth.empty()) return std::nullopt;
  Dataset dataset;
  dataset.images = ListFolder(folder.At("rgb"), folder.options);
  dataset.truth = [truth, listed = dataset.images] {
    std::map<double, double> times;
    for (const ListedImage& image : listed)
      if (const auto number = NumberOfName(image.path)) times[*number] = image.timestamp;
    std::vector<StampedPose> poses;
    for (const StampedPose& pose : LoadTrajectory(truth))
      if (const auto time = times.find(pose.timestamp); time != times.end())
        poses.push_back({time->second, pose.world_from_cam});
    return poses;
  };
  return dataset;
}

std::optional<Dataset> FindScanNet(const DatasetFolder& folder) {
  const std::string camera =
      folder.First({"intrinsic/intrinsic_color.txt", "intrinsics/intrinsic_color.txt"});
  if (!folder.Has("color") || (camera.empty() && !folder.Has("pose"))) return std::nullopt;
  Dataset dataset;
  dataset.images = ListFolder(folder.At("color"), folder.options);
  dataset.camera = camera;
  if (folder.Has("pose"))
    dataset.truth = [root = folder.At("pose"), listed = dataset.images] {
      return LoadMatrices(listed, [&](const std::string& path) {
        return (fs::path(root) / (WithoutExtension(BaseName(path)) + ".txt")).string();
      });
    };
  return dataset;
}

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

// A path in a transforms.json, such as "./images/0001", which may lack the extension.
std::string PathOfFrame(const DatasetFolder& folder, const std::string& given) {
  const std::string path = fs::path(given).lexically_normal().string();
  if (folder.Has(path)) return folder.At(path);
  for (const char* extension : {".png", ".jpg"})
    if (folder.Has(path + extension)) return folder.At(path + extension);
  return folder.At(path);
}

std::optional<Dataset> FindNerfstudio(const DatasetFolder& folder) {
  const std::string path = folder.At("transforms.json");
  if (!folder.Has("transforms.json")) return std::nullopt;
  const json root = ParseObject(path);
  const auto frames = root.find("frames");
  if (frames == root.end() || !frames->is_array())
    throw InputError(fmt::format("{}: key frames is missing, expected a list", path));
  Dataset dataset;
  std::map<std::string, Rigid3> poses;
  for (size_t i = 0; i < frames->size(); ++i) {
    const json& frame = (*frames)[i];
    const std::string place = fmt::format("{}: frames[{}]", path, i);
    if (!frame.is_object() || !frame.contains("file_path") || !frame["file_path"].is_string())
      throw InputError(fmt::format("{}: key file_path is missing", place));
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
      throw InputError(fmt::format("{}: fps: {}, allowed: above 0 to 10000", path, *options.fps));
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
    throw InputError(
        fmt::format("{} (the folder is taken for {}; --dataset none: for its images "
                    "alone)",
                    error.what(), layout.name));
  }
  if (!found) return std::nullopt;
  found->layout = layout.name;
  if (found->film.empty() && found->images.empty())
    throw InputError(
        fmt::format("{}: in the layout of {}, but no images", folder.root, layout.name));
  return found;
}

}  // namespace

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
    throw InputError(fmt::format("--dataset {}: allowed: {} | none", options.dataset,
                                 fmt::join(DatasetLayouts(), " | ")));
  const bool is_folder = fs::is_directory(folder, error);
  for (const DatasetLayout& layout : kLayouts) {
    if (!is_folder || (!asked.empty() && asked != Lower(layout.name))) continue;
    if (std::optional<Dataset> found = FindLayout(layout, {folder, options})) return found;
  }
  if (!asked.empty())
    throw InputError(fmt::format("{}: --dataset {}: is no folder in that layout (docs/formats.md)",
                                 folder, options.dataset));
  return std::nullopt;
}

std::string FilmOf(const std::string& source, const ImageSourceOptions& options) {
  const std::optional<Dataset> dataset = FindDataset(source, options);
  return dataset && !dataset->film.empty() ? dataset->film : source;
}

}  // namespace oaslam
