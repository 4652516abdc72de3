#include "frame_inputs.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <thread>
#include <utility>

#include "camera_choice.h"
#include "oaslam/camera_file.h"
#include "oaslam/formats/imu_file.h"
#include "oaslam/geometry/degree.h"

namespace oaslam::apps {

CLI::Option* AddImuOption(CLI::App& app, SideFiles& files) {
  return app
      .add_option("--imu", files.imu,
                  "a gyroscope beside the camera, as EuRoC's imu0/data.csv; how it lies to the "
                  "camera is read from the calibration (T_BS, T_cam_imu)")
      ->type_name("FILE");
}

SideInputs::SideInputs(const SideFiles& files, const std::string& camera,
                       const DetectorSettings& detector_settings)
    : detector(LoadDetector(detector_settings)) {
  if (!files.detections.empty()) detections = LoadDetections(files.detections);
  if (!files.gravity.empty()) gravity = GravityTrack::Load(files.gravity);
  if (files.imu.empty()) return;
  const bool is_auto = IsAutoCamera(camera);
  const auto camera_from_imu = is_auto ? std::nullopt : LoadCameraFromImu(camera);
  axes = camera_from_imu
             ? "axes turned to the camera's as " + camera + " says"
             : fmt::format("axes taken to be the camera's, since --camera {} does not tell others",
                           is_auto ? "auto" : camera);
  angular_velocity = LoadImu(files.imu, camera_from_imu.value_or(Eigen::Quaterniond::Identity()));
}

FrameInputs::FrameInputs(const Sources& sources, SideInputs side, const CommonOptions& common)
    : side_(std::move(side)), is_lost_(sources.in_map) {
  // One thread for OpenCV: for the small images of a pyramid its threads cost more than they gain,
  // and a detector that works ahead has its own threads.
  cv::setNumThreads(side_.detector && sources.live ? -1 : 1);
  ImageSourceOptions range = FrameRange(common);
  range.color = side_.detector != nullptr;
  range.color_if_free = sources.for_display;
  images_ = OpenImages(sources.images, range);
  if (sources.live && (range.follow || sources.images.starts_with("webcam:"))) {
    auto latest = std::make_unique<LatestImageSource>(std::move(images_));
    latest_ = latest.get();
    images_ = std::move(latest);
  }
  std::optional<InputImage> first = NextReadable();
  if (!first) throw InputError(fmt::format("{}: no readable image", sources.images));
  const cv::Size size = first->image.size();
  const bool is_auto = IsAutoCamera(sources.camera);
  camera_ = sources.known_camera ? *sources.known_camera
                                 : LoadCamera(is_auto ? "fov:65" : sources.camera, size);
  if (side_.detector) StartDetector(sources, range);
  // Not for a growing folder or a camera, where an image would have to wait for the ones after it.
  if (pool_ && !range.follow && !sources.images.starts_with("webcam:"))
    most_ahead_ = pool_->MostAhead(first->image);
  const bool is_chosen = Choose(*first);
  read_.push_back({std::move(*first), is_chosen});
  ++read_count_;
  if (camera_.is_guess && !sources.known_camera && !is_auto)
    spdlog::warn("{}: a guess, not a calibration; expect a bent map", sources.camera);
}

std::optional<InputImage> FrameInputs::NextReadable() {
  while (std::optional<InputImage> image = images_->Next()) {
    if (image->image.empty()) {
      spdlog::warn("image {} ({}): missing or unreadable, skipped", image->index, image->name);
      continue;
    }
    if (last_timestamp_ && !(image->timestamp > *last_timestamp_)) {
      spdlog::warn("image {} ({}): time stamp {:.6f} is not after {:.6f}, skipped", image->index,
                   image->name, image->timestamp, *last_timestamp_);
      continue;
    }
    if (!first_timestamp_) first_timestamp_ = image->timestamp;
    last_timestamp_ = image->timestamp;
    return image;
  }
  return std::nullopt;
}

void FrameInputs::StartDetector(const Sources& sources, const ImageSourceOptions& range) {
  given_turn_ = TurnOf(sources.detector);
  if (!given_turn_ && side_.gravity.empty() && !sources.live && !range.follow &&
      !sources.images.starts_with("webcam:"))
    usual_turn_ = FindTurn(sources.images, range, *side_.detector);
  if (sources.live) {
    const auto detect = [this](const cv::Mat& image) { return side_.detector->Detect(image); };
    background_ = std::make_unique<BackgroundDetector>(TurnedDetector(detect, given_turn_));
    return;
  }
  // Each has a copy of the network. Few images are chosen, so that four keep ahead of the tracker.
  constexpr unsigned kMostThreads = 4;
  const unsigned threads = std::clamp(std::thread::hardware_concurrency(), 1U, kMostThreads);
  std::vector<DetectorPool::Detect> detectors;
  detectors.push_back([this](const cv::Mat& image) { return side_.detector->Detect(image); });
  for (unsigned i = 1; i < threads; ++i)
    detectors.push_back([copy = std::shared_ptr<Detector>(LoadDetector(sources.detector))](
                            const cv::Mat& image) { return copy->Detect(image); });
  pool_ = std::make_unique<DetectorPool>(std::move(detectors));
  detect_every_ = sources.detector.every;
}

bool FrameInputs::Choose(const InputImage& image) {
  if (!pool_) return false;
  return detect_every_ > 0 ? read_count_ % detect_every_ == 0
                           : view_change_.Choose(image.image, image.timestamp);
}

void FrameInputs::Read(size_t ahead, bool looks_at_all) {
  while (read_.size() < ahead + 1) {
    std::optional<InputImage> image = NextReadable();
    if (!image) break;
    const bool is_chosen = Choose(*image);
    read_.push_back({std::move(*image), is_chosen});
    ++read_count_;
  }
  // A lost camera will probably need the detections of images that are not chosen, too.
  if (pool_)
    for (ReadImage& read : read_)
      if ((read.is_chosen || looks_at_all) && !read.found.valid()) {
        read.turn = TurnFor(read.image);
        read.found = pool_->Add(Turned(read.image.image, read.turn));
      }
}

int FrameInputs::TurnFor(const InputImage& image) {
  if (given_turn_) return *given_turn_;
  return KnownTurn(image, side_.gravity.At(image.timestamp)).value_or(usual_turn_);
}

void FrameInputs::DetectLate(int frame, const cv::Mat& image,
                             const std::optional<Eigen::Vector3d>& gravity_in_cam) {
  if (!background_) return;
  // Where it is not known, the detector finds it.
  const std::optional<int> known =
      given_turn_ || !gravity_in_cam ? std::nullopt : UprightTurn(*gravity_in_cam);
  late_turns_[frame] = {known.value_or(0), image.size()};
  background_->Offer(frame, Turned(image, known.value_or(0)));
}

std::vector<BackgroundDetector::Result> FrameInputs::TakeLate() {
  if (!background_) return {};
  std::vector<BackgroundDetector::Result> results = background_->Take();
  for (BackgroundDetector::Result& result : results) {
    const auto [turn, size] = late_turns_[result.frame];
    TurnBack(turn, size, result.detections);
    late_turns_.erase(late_turns_.begin(), late_turns_.upper_bound(result.frame));
  }
  return results;
}

std::optional<FrameInput> FrameInputs::Next() {
  const bool looks_at_all = is_lost_ && detect_every_ == 0;
  Read(most_ahead_, looks_at_all);
  if (read_.empty()) return std::nullopt;
  ReadImage read = std::move(read_.front());
  read_.pop_front();
  const InputImage& image = read.image;
  FrameInput frame;
  frame.index = image.index;
  frame.name = image.name;
  frame.path = image.path;
  frame.orientation = image.orientation;
  frame.input.image = image.image;
  frame.input.timestamp = image.timestamp;
  frame.input.gravity_in_cam = side_.gravity.At(image.timestamp);
  const std::vector<AngularVelocity>& samples = side_.angular_velocity;
  for (; given_samples_ < samples.size() &&
         samples[given_samples_].timestamp <= image.timestamp + Gyroscope::kMostOffset;
       ++given_samples_)
    frame.input.angular_velocity.push_back(samples[given_samples_]);
  if (background_) {
    frame.input.detections_follow = true;
  } else if (!pool_) {
    frame.input.detections = side_.detections.Find(image.name);
  } else if (read.is_chosen || looks_at_all) {
    frame.input.detections = read.found.get();
    TurnBack(read.turn, image.image.size(), frame.input.detections);
    ++looked_at_;
  }
  return frame;
}

void FrameInputs::ReportSensors(const Gyroscope& gyroscope) const {
  side_.gravity.WarnIfUnused();
  const std::vector<AngularVelocity>& samples = side_.angular_velocity;
  if (samples.empty()) return;
  if (samples.front().timestamp > *last_timestamp_ ||
      samples.back().timestamp < *first_timestamp_) {
    spdlog::warn(
        "--imu: no sample near any image: it has {:.3f} to {:.3f} s, the images {:.3f} to "
        "{:.3f} s",
        samples.front().timestamp, samples.back().timestamp, *first_timestamp_, *last_timestamp_);
    return;
  }
  const GyroscopeCalibration& known = gyroscope.calibration();
  const Eigen::Vector3d bias = known.bias / kDegree;
  switch (gyroscope.state()) {
    case Gyroscope::State::kUnknown:
      spdlog::warn(
          "gyroscope: bias and clock not known at the end: the camera hardly turned, or few images "
          "that fit well had samples; {}",
          side_.axes);
      break;
    case Gyroscope::State::kRefused:
      spdlog::warn(
          "gyroscope: refused at the end, most images contradict it: its axes, its unit (rad/s) or "
          "its clock (within {} s of the images') are wrong; {}",
          Gyroscope::kMostOffset, side_.axes);
      break;
    case Gyroscope::State::kCalibrated:
      spdlog::info(
          "gyroscope: bias {:.3f} {:.3f} {:.3f} (sigma {:.3f}) deg/s, clock ahead by {:.1f} (sigma "
          "{:.1f}) ms; {}",
          bias.x(), bias.y(), bias.z(), known.sigma_bias / kDegree, 1e3 * known.offset_s,
          1e3 * known.sigma_offset_s, side_.axes);
  }
}

}  // namespace oaslam::apps
