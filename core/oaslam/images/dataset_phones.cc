#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/time_unit.h"
#include "oaslam/images/dataset_layouts.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

// Of apps that scan with a phone.
namespace oaslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// What a JSON file beside an image says of it.
struct PhoneImage {
  std::string image, file;  // paths; `file` is empty where there is none
  double focal_length = 0;  // pixels; 0: not known
  std::optional<double> time;
  std::vector<double> pose;  // the rows of camera to world, camera axes of OpenGL; empty: none
};

std::optional<double> NumberOf(const json& object, const std::string& key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

// The file of the image with the median focal length: an autofocus changes it a little with each
// image. Empty where none is known.
std::string MedianCamera(std::vector<PhoneImage> images, const DatasetFolder& folder) {
  std::erase_if(images, [](const PhoneImage& image) { return !(image.focal_length > 0); });
  if (images.empty()) return "";
  std::ranges::stable_sort(images, {}, &PhoneImage::focal_length);
  const double least = images.front().focal_length, most = images.back().focal_length;
  constexpr double kBreathing = 0.02;  // more is a zoom, or another lens
  if (most > (1 + kBreathing) * least && !folder.options.quiet)
    Log(LogLevel::kWarning,
        "{}: its focal length changes from {:.1f} to {:.1f} px from image to image; one camera, "
        "that of the median, is taken for all",
        folder.root, least, most);
  return images[images.size() / 2].file;
}

void SetTruthOf(const std::vector<PhoneImage>& images, bool has_times, Dataset& dataset) {
  if (std::ranges::all_of(images, [](const PhoneImage& image) { return image.pose.empty(); }))
    return;
  const auto poses = [images] {
    std::vector<NamedPose> found;
    for (const PhoneImage& image : images)
      if (!image.pose.empty())
        found.push_back({image.image, FromOpenGl(PoseOfMatrix(image.pose, image.file))});
    return found;
  };
  SetNamedTruth(poses, has_times, dataset);
}

// The images of a folder whose names begin with `begin`, with what `read` finds in the file of
// each.
template <typename Read>
std::vector<PhoneImage> ReadPhoneImages(const std::string& images, const std::string& files,
                                        const std::string& begin, Read read) {
  std::vector<PhoneImage> found;
  for (const std::string& name : ImageNames(images)) {
    if (!name.starts_with(begin)) continue;
    PhoneImage& image = found.emplace_back();
    image.image = (fs::path(images) / name).string();
    const std::string file = (fs::path(files) / (WithoutExtension(name) + ".json")).string();
    std::error_code error;
    if (!fs::exists(file, error)) continue;
    image.file = file;
    read(ParseObject(file), image);
  }
  return found;
}

// The first "frame_00000.json", by name; empty where there is none.
std::string FirstFrameFile(const DatasetFolder& folder) {
  std::error_code error;
  std::string first;
  for (const auto& entry : fs::directory_iterator(folder.root, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("frame_") && name.ends_with(".json") && (first.empty() || name < first))
      first = name;
  }
  return first.empty() ? "" : folder.At(first);
}

// The times that the files state, where they are those of a recording: known of all images, and
// ascending.
bool SetTimesOfFiles(const std::vector<PhoneImage>& images, Dataset& dataset) {
  for (size_t i = 0; i < images.size(); ++i)
    if (!images[i].time || (i > 0 && !(*images[i].time > *images[i - 1].time))) return false;
  for (size_t i = 0; i < images.size(); ++i) dataset.images[i].timestamp = *images[i].time;
  return true;
}

// The names of Polycam's images are times of ARKit, whole numbers in a unit that their steps tell.
// Nothing for names that count.
std::optional<double> UnitOfNames(const std::vector<PhoneImage>& images) {
  std::vector<double> numbers;
  for (const PhoneImage& image : images) {
    const auto number = ParseNumber(WithoutExtension(BaseName(image.image)));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  constexpr double kLeastStep = 1000;  // of microseconds: 1 ms
  const double step = MedianStep(numbers);
  return step < kLeastStep ? std::nullopt : std::optional(UnitOfStep(step));
}

// Takes the times of a film from the first numbers of the lines of a file, if there is one, and
// with them where they begin by the clock of the phone; nothing where they do not ascend. Returns
// whether it took them.
bool TakeFilmTimes(const std::string& path, double unit, Dataset& dataset) {
  if (path.empty()) return false;
  const std::string text = ReadTextFile(path);
  std::vector<double> times;
  for (const std::string_view line : SplitLines(text))
    if (const auto number = ParseNumber(SplitCommas(line).front())) times.push_back(unit * *number);
  if (times.empty() || std::ranges::adjacent_find(times, std::greater_equal()) != times.end())
    return false;
  dataset.imu_begin_s = times.front();
  for (double& time : times) time -= dataset.imu_begin_s;
  dataset.film_times = std::move(times);
  return true;
}

}  // namespace

std::optional<Dataset> FindScannerApp(const DatasetFolder& folder) {
  const std::string first = FirstFrameFile(folder);
  if (first.empty()) return std::nullopt;
  if (const json root = json::parse(ReadTextFile(first), nullptr, false);
      !root.is_object() || !root.contains("cameraPoseARFrame"))
    return std::nullopt;
  const auto images =
      ReadPhoneImages(folder.root, folder.root, "frame_", [](const json& root, PhoneImage& image) {
        image.time = NumberOf(root, "time");
        if (const auto k = root.find("intrinsics"); k != root.end())
          image.focal_length = NumbersOf(*k, 9, image.file + ": intrinsics")[0];
        if (const auto pose = root.find("cameraPoseARFrame"); pose != root.end())
          image.pose = NumbersOf(*pose, 12, image.file + ": cameraPoseARFrame");
      });
  Dataset dataset;
  for (const PhoneImage& image : images) dataset.images.push_back({0, image.image});
  SetTimes(folder.root, folder.options, dataset.images);
  const bool has_times = !folder.options.fps && SetTimesOfFiles(images, dataset);
  dataset.camera = MedianCamera(images, folder);
  if (folder.Has(WithoutExtension(BaseName(first)).replace(0, 5, "depth").append(".png").c_str()))
    dataset.depth = folder.Depths(".");
  SetTruthOf(images, has_times, dataset);
  return dataset;
}

std::optional<Dataset> FindPolycam(const DatasetFolder& given) {
  const DatasetFolder folder{given.Has("keyframes") ? given.At("keyframes") : given.root,
                             given.options};
  // The corrected ones are those after the app has closed the loops.
  const bool is_corrected = folder.Has("corrected_cameras");
  const std::string cameras = is_corrected ? "corrected_cameras" : "cameras";
  const std::string images_of =
      is_corrected && folder.Has("corrected_images") ? "corrected_images" : "images";
  if (!folder.Has(images_of) || !folder.Has(cameras)) return std::nullopt;
  const auto images = ReadPhoneImages(
      folder.At(images_of), folder.At(cameras), "", [](const json& root, PhoneImage& image) {
        image.focal_length = NumberOf(root, "fx").value_or(0);
        for (const char* key : {"t_00", "t_01", "t_02", "t_03", "t_10", "t_11", "t_12", "t_13",
                                "t_20", "t_21", "t_22", "t_23"})
          if (const auto number = NumberOf(root, key)) image.pose.push_back(*number);
        if (image.pose.size() < 12) image.pose.clear();
      });
  const auto has_focal_length = [](const PhoneImage& image) { return image.focal_length > 0; };
  if (std::ranges::none_of(images, has_focal_length)) return std::nullopt;
  Dataset dataset;
  for (const PhoneImage& image : images) dataset.images.push_back({0, image.image});
  ImageSourceOptions options = folder.options;
  if (!options.time_unit && !options.fps) options.time_unit = UnitOfNames(images);
  const bool has_times = SetTimes(folder.root, options, dataset.images);
  dataset.camera = MedianCamera(images, folder);
  dataset.depth = folder.Depths("depth", "confidence");
  SetTruthOf(images, has_times, dataset);
  return dataset;
}

std::optional<Dataset> FindRecord3d(const DatasetFolder& folder) {
  const std::string path = folder.First({"metadata", "metadata.json"});
  const bool is_of_exr = !folder.Has("rgbd");  // the export with depth in EXR files
  if ((is_of_exr && !folder.Has("rgb")) || path.empty()) return std::nullopt;
  const std::string images = folder.At(is_of_exr ? "rgb" : "rgbd");
  const json root = is_of_exr ? json::parse(ReadTextFile(path), nullptr, false) : ParseObject(path);
  // Other folders are named so, too.
  if (is_of_exr && !(root.is_object() && root.contains("K") && root.contains("poses")))
    return std::nullopt;
  ImageSourceOptions options = folder.options;
  if (const auto fps = root.find("fps"); fps != root.end() && fps->is_number() && !options.fps) {
    options.fps = fps->get<double>();
    if (!(*options.fps > 0 && *options.fps <= 10000))
      throw BadInput("{}: fps: {}, allowed: above 0 to 10000", path, *options.fps);
  }
  Dataset dataset;
  dataset.images = ListFolder(images, options);
  if (root.contains("K")) dataset.camera = path;
  const auto poses = root.find("poses");
  if (poses == root.end() || !poses->is_array() || poses->empty()) return dataset;
  dataset.truth = [poses = *poses, path, listed = dataset.images, images] {
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
  dataset.depth = folder.Depths("depth", "confidence");
  const std::string truth = folder.First({"odometry.csv"});
  if (truth.empty()) return dataset;
  // The film counts images at 60 Hz; Core Motion has the clock of the list. Its axes are those of
  // the upright screen (x right, y up, z out of it); ARKit's images have their top where the phone
  // has its right.
  if (TakeFilmTimes(truth, 1, dataset) && folder.Has("imu.csv")) {
    dataset.imu = folder.At("imu.csv");
    Eigen::Matrix3d cam_from_phone;
    cam_from_phone << 0, -1, 0, -1, 0, 0, 0, 0, -1;
    dataset.cam_from_imu = Rigid3(cam_from_phone, Eigen::Vector3d::Zero());
  }
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

std::optional<Dataset> FindMarsLogger(const DatasetFolder& folder) {
  if (!folder.Has("movie.mp4") || !folder.Has("gyro_accel.csv")) return std::nullopt;
  Dataset dataset;
  dataset.film = folder.At("movie.mp4");
  // In ns, by the clock of the IMU. On iPhones the second is the only one.
  constexpr double kNanosecond = 1e-9;
  if (TakeFilmTimes(folder.First({"frame_timestamps.txt", "movie_metadata.csv"}), kNanosecond,
                    dataset))
    dataset.imu = folder.At("gyro_accel.csv");
  return dataset;
}

}  // namespace oaslam
