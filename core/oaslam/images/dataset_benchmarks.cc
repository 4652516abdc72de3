#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <numeric>

#include "oaslam/formats/imu_pose.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/dataset_layouts.h"
#include "oaslam/images/image_list.h"
#include "oaslam/images/list_clock.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

// Of benchmarks and their recordings.
namespace oaslam {
namespace {

namespace fs = std::filesystem;

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
    throw BadInput("{}: {} numbers, expected a matrix of 4 x 4", path, rows.size());
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

// Poses are twelve numbers a line; "poses/07.txt" of the benchmark is that of "sequences/07".
std::string KittiPoses(const DatasetFolder& folder) {
  const fs::path root = fs::absolute(fs::path(folder.root) / ".").lexically_normal().parent_path();
  const std::string beside = "../../poses/" + root.filename().string() + ".txt";
  return folder.First({"poses.txt", beside.c_str()});
}

// The number that a name is; nothing for another name.
std::optional<double> NumberOfName(const std::string& path) {
  return ParseNumber(WithoutExtension(BaseName(path)));
}

}  // namespace

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
  if (const std::string depth = folder.First({"associations.txt", "depth.txt"}); !depth.empty())
    dataset.depth = LoadDepthFiles(depth);
  // Who wants the colour images alone leaves the others out.
  std::error_code error;
  if (dataset.depth && !fs::exists(dataset.depth->files.front().path, error)) dataset.depth.reset();
  return dataset;
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
  std::vector<int> lines(dataset.images.size());
  std::iota(lines.begin(), lines.end(), 1);
  ContinueTimes(times, lines, folder.options.quiet, dataset.images);
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
      throw BadInput("{}: a scene of 7-Scenes, expected one of its sequences, such as {}",
                     folder.root, folder.At("seq-01"));
    return std::nullopt;
  }
  Dataset dataset;
  dataset.images = ListFolder(folder.root, folder.options, ".color");
  if (folder.Has("frame-000000.depth.png")) {
    dataset.depth = folder.Depths(".");
    dataset.depth->camera =
        Camera{.width = 640, .height = 480, .fx = 585, .fy = 585, .cx = 320, .cy = 240};
    // Of a Kinect, which looks with its colour camera from the right of the depth camera.
    dataset.depth->cam_from_depth.translation.x() = -0.025;
  }
  if (folder.Has("frame-000000.pose.txt"))
    dataset.truth = [listed = dataset.images] {
      return LoadMatrices(listed, [](const std::string& path) {
        return WithoutExtension(WithoutExtension(path)) + ".pose.txt";
      });
    };
  return dataset;
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
  dataset.depth = folder.Depths("depth", "", 1.0 / 5000);
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
  dataset.depth = folder.Depths("depth");
  if (const std::string of_depth =
          folder.First({"intrinsic/intrinsic_depth.txt", "intrinsics/intrinsic_depth.txt"});
      dataset.depth && !of_depth.empty())
    SetDepthCamera(of_depth, *dataset.depth);
  if (folder.Has("pose"))
    dataset.truth = [root = folder.At("pose"), listed = dataset.images] {
      return LoadMatrices(listed, [&](const std::string& path) {
        return (fs::path(root) / (WithoutExtension(BaseName(path)) + ".txt")).string();
      });
    };
  return dataset;
}

}  // namespace oaslam
