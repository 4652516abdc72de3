#include "recorded_inputs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "camera_choice.h"
#include "detection_choice.h"
#include "frame_inputs.h"
#include "oaslam/formats/imu_pose.h"
#include "oaslam/images/video_source.h"
#include "oaslam/recordings/topic_choice.h"
#include "oaslam/util/lower.h"

namespace oaslam::apps {
namespace {

using Taken = std::vector<std::string>;

void TakeCamera(const RecordingSummary& summary, const TopicSummary& images, SideFiles& side,
                Taken& taken) {
  const TopicSummary* info = InfoOf(summary, images);
  if (!info) {
    taken.push_back("no CameraInfo: the lens is estimated from the images");
    return;
  }
  try {
    side.recorded_camera = CameraOf(summary, images);
    taken.push_back(
        side.recorded_camera
            ? fmt::format("camera {}{}", info->topic.name,
                          IsRectified(images) ? " (P, of rectified images)" : "")
            : fmt::format("no camera: {} is not calibrated (K is 0)", info->topic.name));
  } catch (const InputError& error) {
    spdlog::warn("{} (the camera is left out; --camera gives it)", error.what());
  }
}

// The topic that --imu names, or two with a comma between them.
ImuTopics AskedImu(const RecordingSummary& summary, const std::string& asked) {
  const size_t comma = asked.find(',');
  const TopicSummary* first = summary.Find(asked.substr(0, comma));
  const TopicSummary* second =
      comma == std::string::npos ? first : summary.Find(asked.substr(comma + 1));
  const bool are_imus =
      first && second && first->kind == TopicKind::kImu && second->kind == TopicKind::kImu;
  return are_imus ? ImuTopics{first, second} : ImuTopics{};
}

// The IMU, where it is known how it lies to the camera, or where it is asked for.
void TakeImu(const RecordingSummary& summary, const TopicSummary& images, const std::string& camera,
             SideFiles& side, Taken& taken) {
  const ImuTopics asked = AskedImu(summary, side.imu);
  const bool is_asked = asked.gyroscope != nullptr;
  const ImuTopics topics = is_asked ? asked : side.imu.empty() ? ChooseImu(summary) : ImuTopics{};
  if (!topics.gyroscope) return;
  const std::string name = topics.gyroscope->topic.name;
  const std::optional<Rigid3> cam_from_imu = summary.Between(images.frame, topics.gyroscope->frame);
  const bool is_calibrated = !IsAutoCamera(camera) && LoadCameraFromImu(camera).has_value();
  if (!cam_from_imu && !is_calibrated && !is_asked) {
    taken.push_back(fmt::format(
        "no IMU: /tf_static does not tell how the frame \"{1}\" of {0} lies to the camera's "
        "\"{2}\" (--imu {0} takes it with the camera's axes)",
        name, topics.gyroscope->frame, images.frame));
    return;
  }
  ImuTable table;
  table.gyroscope = topics.gyroscope->gyroscope;
  if (topics.accelerometer) {
    // A sensor of its own may lie otherwise.
    const auto along = summary.Between(topics.gyroscope->frame, topics.accelerometer->frame);
    if (along || topics.accelerometer->frame == topics.gyroscope->frame) {
      table.accelerometer = topics.accelerometer->accelerometer;
      if (along)
        for (Eigen::Vector3d& value : table.accelerometer.values) value = along->rotation * value;
    } else {
      spdlog::warn(
          "{}: {}: accelerations left out, since /tf_static does not tell how their frame \"{}\" "
          "lies to the gyroscope's \"{}\"",
          summary.path, topics.accelerometer->topic.name, topics.accelerometer->frame,
          topics.gyroscope->frame);
    }
  }
  const std::string place = summary.path + ": " + name;
  try {
    side.recorded_imu = MendImu(std::move(table), {place, place});
  } catch (const InputError& error) {
    if (is_asked) throw;
    spdlog::warn("{} (the IMU is left out)", error.what());
    return;
  }
  side.imu.clear();
  side.imu_place = place;
  side.cam_from_imu = cam_from_imu;
  side.recorded_axes = cam_from_imu
                           ? "axes turned to the camera's as /tf_static says"
                           : "axes taken to be the camera's, since /tf_static does not tell others";
  taken.push_back("IMU " + name);
  if (topics.gyroscope->without_stamp > 0)
    spdlog::warn(
        "{}: {} headers have no time stamp: the times at which they were recorded are used", place,
        topics.gyroscope->without_stamp);
}

void TakeDepths(const RecordingSummary& summary, const TopicSummary& images, SideFiles& side,
                Taken& taken) {
  if (Lower(side.depth) == "none") return;
  const TopicSummary* asked = side.depth.empty() ? nullptr : summary.Find(side.depth);
  if (!side.depth.empty() && !asked) return;
  if (asked && !IsDepth(*asked))
    throw BadInput("{}: --depth {}: has {}, allowed: 16UC1, 32FC1", summary.path, side.depth,
                   asked->format.empty() ? asked->topic.type : asked->format);
  const TopicSummary* depths = asked ? asked : ChooseDepths(summary, images);
  if (!depths) return;
  DepthFiles files{.path = summary.path, .files = {}, .topic = depths->topic.name};
  if (depths->frame != images.frame) {
    const auto cam_from_depth = summary.Between(images.frame, depths->frame);
    try {
      files.camera = CameraOf(summary, *depths);
      if (!files.camera || !cam_from_depth)
        throw BadInput("{}: {}: its frame \"{}\" is not \"{}\" of the images, and {}", summary.path,
                       depths->topic.name, depths->frame, images.frame,
                       files.camera ? "/tf_static does not tell how it lies"
                                    : "no CameraInfo of it is calibrated");
    } catch (const InputError& error) {
      if (asked) throw;
      spdlog::warn("{} (its depths are left out)", error.what());
      return;
    }
    files.cam_from_depth = *cam_from_depth;
  }
  side.depth.clear();
  side.depth_of_dataset = std::move(files);
  taken.push_back("depths of " + depths->topic.name);
}

// A class by its number, or by its name, which gets a number in `names`.
std::optional<int> CategoryOf(const std::string& class_id, bool are_numbers, ClassNames& names) {
  if (are_numbers) return std::stoi(class_id);
  for (const auto& [id, name] : names)
    if (name == class_id) return id;
  const int id = static_cast<int>(names.size());
  names[id] = class_id;
  return id;
}

bool IsNumber(const std::string& text) {
  constexpr size_t kMostDigits = 6;
  return !text.empty() && text.size() <= kMostDigits &&
         text.find_first_not_of("0123456789") == std::string::npos;
}

// Nothing where the box or its best score is impossible.
std::optional<Detection> DetectionOf(const RosDetection& found, bool are_numbers,
                                     ClassNames& names) {
  const double c = std::abs(std::cos(found.theta)), s = std::abs(std::sin(found.theta));
  const double width = c * found.width + s * found.height,
               height = s * found.width + c * found.height;
  if (!(width > 0 && height > 0) || !std::isfinite(width + height + found.x + found.y))
    return std::nullopt;
  std::vector<Label> labels;
  for (const RosDetection::Hypothesis& hypothesis : found.hypotheses)
    if (const auto id = CategoryOf(hypothesis.class_id, are_numbers, names);
        id && hypothesis.score > 0 && hypothesis.score <= 1 &&
        std::ranges::find(labels, *id, &Label::category_id) == labels.end())
      labels.push_back({*id, hypothesis.score});
  if (labels.empty()) return std::nullopt;
  std::ranges::stable_sort(labels, std::greater(), &Label::score);
  Detection detection{.category_id = labels[0].category_id,
                      .score = labels[0].score,
                      .box = {found.x - width / 2, found.y - height / 2, found.x + width / 2,
                              found.y + height / 2}};
  detection.other_labels.assign(labels.begin() + 1, labels.end());
  return detection;
}

using ImageByTime = std::map<double, int>;

// The number of the image of this time, which a detector copies from it; nothing: there is none.
std::optional<int> ImageAt(const ImageByTime& images, double time) {
  constexpr double kRounding = 1e-3;  // seconds
  const auto found = images.lower_bound(time - kRounding);
  if (found == images.end() || found->first > time + kRounding) return std::nullopt;
  return found->second;
}

DetectionFile DetectionsOf(const TopicSummary& topic, const TopicSummary& images) {
  bool are_numbers = true;
  for (const RosDetections& message : topic.detections)
    for (const RosDetection& detection : message.detections)
      for (const auto& hypothesis : detection.hypotheses)
        are_numbers = are_numbers && IsNumber(hypothesis.class_id);
  ImageByTime image_at;
  for (size_t i = 0; i < images.times.size(); ++i)
    image_at.emplace(images.times[i], static_cast<int>(i));
  DetectionFile file{.images = {}};
  size_t unusable = 0, without_image = 0;
  for (size_t i = 0; i < topic.detections.size(); ++i) {
    const auto image = ImageAt(image_at, topic.times[i]);
    if (!image) {
      ++without_image;
      continue;
    }
    ImageDetections found{NameOfVideoImage(*image), {}};
    for (const RosDetection& detection : topic.detections[i].detections)
      if (auto one = DetectionOf(detection, are_numbers, file.categories))
        found.detections.push_back(std::move(*one));
      else
        ++unusable;
    file.images.push_back(std::move(found));
  }
  if (unusable > 0)
    spdlog::warn("{}: {} boxes without area or with a score outside of 0 to 1 are left out",
                 topic.topic.name, unusable);
  if (without_image > 0)
    spdlog::warn("{}: {} of {} messages have the time stamp of no image and are left out",
                 topic.topic.name, without_image, topic.detections.size());
  return file;
}

void TakeDetections(const RecordingSummary& summary, const TopicSummary& images,
                    const CommonOptions& common, const FromRecording& into, Taken& taken) {
  std::vector<const TopicSummary*> topics;
  for (const TopicSummary& topic : summary.topics)
    if (topic.kind == TopicKind::kDetections) topics.push_back(&topic);
  if (topics.empty() || !into.detector || !into.side->detections.empty()) return;
  if (topics.size() > 1) {
    taken.push_back(fmt::format("no detections: there are {} topics of them", topics.size()));
    return;
  }
  DetectionFile file = DetectionsOf(*topics[0], images);
  if (file.images.empty()) return;
  // Numbers are those of --classes; names are looked up in it.
  if (!file.categories.empty() && !common.classes.empty() &&
      !RenumberByName(file.categories, LoadClasses(common).names, file.images))
    throw BadInput("{}: {}: has classes that are not in {}", summary.path, topics[0]->topic.name,
                   common.classes);
  into.side->recorded_detections =
      WithClassesInUse(std::move(file), summary.path + ": " + topics[0]->topic.name, common);
  into.detector->model.clear();
  taken.push_back("detections of " + topics[0]->topic.name);
}

Taken Take(const RecordingSummary& summary, const CommonOptions& common,
           const FromRecording& into) {
  const TopicSummary& images = ChooseImages(summary, common.topic);
  Taken taken = {fmt::format("{} images of {}", images.times.size(), images.topic.name)};
  if (Lower(common.dataset) == "none") return taken;
  for (const TopicSummary& topic : summary.topics)
    if (!topic.problem.empty())
      spdlog::warn("{}: {} (it and later messages of this topic are left out)", topic.topic.name,
                   topic.problem);
  if (into.camera->empty()) TakeCamera(summary, images, *into.side, taken);
  const bool is_timed = !common.fps;  // else the times of the images are others
  if (is_timed || !into.side->imu.empty())
    TakeImu(summary, images, *into.camera, *into.side, taken);
  if (is_timed || !into.side->depth.empty()) TakeDepths(summary, images, *into.side, taken);
  if (!is_timed) taken.push_back("no IMU and no depths unless asked for, because of --fps");
  TakeDetections(summary, images, common, into, taken);
  return taken;
}

}  // namespace

void TakeRecording(const std::string& images, const CommonOptions& common,
                   const FromRecording& into) {
  if (images.empty() || !IsRecording(images)) return;
  const Taken taken = Take(*SummaryOf(images), common, into);
  spdlog::info("{}: taken (--dataset none: the images alone): {}", images, fmt::join(taken, ", "));
}

std::vector<std::string> TakenLines(const RecordingSummary& summary) {
  std::string camera;
  SideFiles side;
  DetectorSettings detector;
  try {
    return {fmt::format("oaslam takes {}",
                        fmt::join(Take(summary, {}, {&camera, &side, &detector}), ", "))};
  } catch (const InputError& error) {
    return {error.what()};
  }
}

}  // namespace oaslam::apps
