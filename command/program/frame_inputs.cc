#include "frame_inputs.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <opencv2/core/utility.hpp>
#include <thread>

#include "camera_choice.h"
#include "detection_choice.h"
#include "oaslam/camera_file.h"
#include "oaslam/formats/imu_file.h"
#include "oaslam/formats/imu_pose.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/images/video_source.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam::apps {

CLI::Option* AddImuOption(CLI::App& app, SideFiles& files) {
  return app
      .add_option("--imu", files.imu,
                  "the IMU or gyroscope beside the camera, as EuRoC, MARS Logger, Stray Scanner, "
                  "Sensor Logger and others record it (a file, two with a comma, or a folder); "
                  "how it lies to the camera is read from the calibration (T_cam_imu, T_BS); or a "
                  "topic of a recording of ROS")
      ->type_name("FILE");
}

CLI::Option* AddDepthOptions(CLI::App& app, SideFiles& files) {
  CLI::Option* depth =
      app.add_option(
             "--depth", files.depth,
             "images of a depth camera: a folder, or a list as TUM's depth.txt or "
             "associations.txt, or a topic of a recording of ROS; by default those of a dataset "
             "or recording; none: without")
          ->type_name("PATH");
  app.add_option("--depth-unit", files.depth_unit,
                 "metres of a count: by default that of a dataset, 0.0002 for a list, 0.001 for a "
                 "folder")
      ->type_name("METRES")
      ->check(CLI::PositiveNumber);
  app.add_option("--depth-camera", files.depth_camera,
                 "calibration of a depth camera whose images are not registered to the colour "
                 "images; T_cam_depth in it tells how it lies")
      ->type_name("FILE");
  return depth;
}

namespace {

std::optional<DepthFiles> DepthOf(const SideFiles& files) {
  if (Lower(files.depth) == "none") return std::nullopt;
  std::optional<DepthFiles> found = files.depth_of_dataset;
  if (!files.depth.empty()) found = LoadDepthFiles(files.depth);
  if (!found) {
    if (files.depth_unit || !files.depth_camera.empty())
      throw InputError("--depth-unit, --depth-camera: need --depth, or a dataset with depth");
    return std::nullopt;
  }
  if (files.depth_unit) found->unit = *files.depth_unit;
  if (!files.depth_camera.empty()) SetDepthCamera(files.depth_camera, *found);
  return found;
}

// YOLO's texts of a film are named by it and count from 1: walk_1.txt is of image 000000 of
// walk.mp4.
DetectionTable CountedFrom0(const DetectionTable& given, const std::string& film) {
  const std::string begin = WithoutExtension(BaseName(film)) + "_";
  std::vector<ImageDetections> images = given.images();
  for (ImageDetections& image : images) {
    const auto number = image.file_name.starts_with(begin)
                            ? ParseNumber(std::string_view(image.file_name).substr(begin.size()))
                            : std::nullopt;
    constexpr double kMost = 1e8;
    if (!number || !(*number >= 1 && *number <= kMost)) return given;
    image.file_name = NameOfVideoImage(static_cast<int>(*number) - 1);
  }
  return DetectionTable(std::move(images));
}

}  // namespace

SideInputs::SideInputs(const SideFiles& files, const std::string& camera,
                       const DetectorSettings& detector_settings, const CommonOptions& common)
    : detections_path(files.detections), detector(LoadDetector(detector_settings)) {
  if (!files.detections.empty()) {
    DetectionFile file = LoadDetectionsFor(files.detections, common);
    in_shares = file.in_shares;
    detections = DetectionTable(std::move(file.images));
    categories = std::move(file.categories);
  } else if (files.recorded_detections) {
    detections = DetectionTable(files.recorded_detections->images);
    categories = files.recorded_detections->categories;
  }
  recorded_camera = files.recorded_camera;
  if (!files.gravity.empty()) gravity = GravityTrack::Load(files.gravity);
  depth = DepthOf(files);
  if (files.imu.empty() && !files.recorded_imu) return;
  const bool is_auto = IsAutoCamera(camera);
  const auto calibrated = is_auto ? std::nullopt : LoadCameraFromImu(camera);
  axes = calibrated           ? "axes turned to the camera's as " + camera + " says"
         : files.recorded_imu ? files.recorded_axes
         : files.cam_from_imu
             ? "axes turned to the camera's as those of its recorder"
             : fmt::format("axes taken to be the camera's, since --camera {} does not tell others",
                           is_auto ? "auto" : camera);
  cam_from_imu = calibrated.value_or(files.cam_from_imu.value_or(Rigid3()));
  try {
    imu = files.recorded_imu ? *files.recorded_imu : LoadImu(files.imu);
  } catch (const InputError& error) {
    if (!files.imu_may_fail) throw;
    spdlog::warn("{} (the IMU of the dataset, left out)", error.what());
  }
  for (ImuSample& sample : imu.samples) sample.timestamp -= files.imu_begin_s;
  for (const std::string& note : imu.notes)
    spdlog::warn("{}: {}", files.recorded_imu ? files.imu_place : files.imu, note);
}

std::optional<Vertical> VerticalIn(const Slam& slam, const FrameInput& frame,
                                   const TrackingResult& result) {
  if (frame.input.gravity_in_cam) return Vertical{*frame.input.gravity_in_cam, true};
  const MapSnapshot map = slam.Snapshot();
  const std::optional<Rigid3> pose = result.PoseIn(map.world());
  if (!map.up() || !pose) return std::nullopt;
  return Vertical{pose->rotation.conjugate() * -*map.up(), map.is_up_measured()};
}

FrameInputs::FrameInputs(const Sources& sources, SideInputs side, const CommonOptions& common)
    : side_(std::move(side)) {
  // One thread for OpenCV: for the small images of a pyramid its threads cost more than they gain,
  // and a detector that works ahead has its own threads.
  cv::setNumThreads(side_.detector && sources.live ? -1 : 1);
  ImageSourceOptions range = FrameRange(common);
  range.color = side_.detector != nullptr;
  range.color_if_free = sources.for_display;
  std::unique_ptr<ImageSource> images = OpenImages(sources.images, range);
  if (!side_.detections_path.empty()) {
    const std::vector<std::string> names = NamesOfImages(sources.images, range);
    if (side_.in_shares && !names.empty() && names.front() == NameOfVideoImage(0))
      side_.detections = CountedFrom0(side_.detections, sources.images);
    side_.detections = MatchedToImages(side_.detections, names, side_.detections_path);
  }
  const bool comes_late = range.follow || IsCamera(sources.images);
  if (side_.depth && comes_late)
    throw InputError("--depth: not with a camera or a folder that grows");
  if (side_.depth) depths_.emplace(*side_.depth, TimesOfImages(sources.images, range));
  if (sources.live && comes_late) {
    auto latest = std::make_unique<LatestImageSource>(std::move(images));
    latest_ = latest.get();
    images = std::move(latest);
  }
  images_ = std::make_unique<ReadableImages>(
      std::move(images),
      ReadableImages::Options{.any_size = sources.any_size, .is_live = comes_late});
  std::optional<InputImage> first = NextReadable();
  if (!first) throw images_->NoneReadable(sources.images);
  // A camera that begins in a given map is lost until it is found.
  if (sources.in_map) lost_since_s_ = first->timestamp;
  const cv::Size size = images_->size();
  CheckImage(first->image, sources.images);
  if (side_.in_shares) {
    DetectionFile file{.images = side_.detections.images(), .in_shares = true};
    ConvertShares(size.width, size.height, file);
    side_.detections = DetectionTable(std::move(file.images));
  }
  const bool is_auto = IsAutoCamera(sources.camera);
  if (side_.recorded_camera) CheckRecordedCamera(*side_.recorded_camera, size, sources.images);
  camera_ = sources.known_camera    ? *sources.known_camera
            : side_.recorded_camera ? *side_.recorded_camera
                                    : LoadCamera(is_auto ? "fov:65" : sources.camera, size);
  if (side_.detector) StartDetector(sources, range);
  // Not for a growing folder or a camera, where an image would have to wait for the ones after it.
  if (pool_ && !comes_late) most_ahead_ = pool_->MostAhead(first->image);
  const bool is_chosen = Choose(*first);
  read_.push_back({std::move(*first), is_chosen});
  ++read_count_;
  if (camera_.is_guess && !side_.recorded_camera && !sources.known_camera && !is_auto)
    spdlog::warn("{}: a guess, not a calibration; expect a bent map", sources.camera);
}

std::optional<InputImage> FrameInputs::NextReadable() {
  std::optional<InputImage> image = images_->Next();
  if (image && !first_timestamp_) first_timestamp_ = image->timestamp;
  if (image) last_timestamp_ = image->timestamp;
  return image;
}

void FrameInputs::StartDetector(const Sources& sources, const ImageSourceOptions& range) {
  given_turn_ = TurnOf(sources.detector);
  if (!given_turn_ && side_.gravity.empty() && !sources.live && !range.follow &&
      !IsCamera(sources.images))
    turn_by_boxes_ = FindTurn(sources.images, range, *side_.detector);
  if (sources.live) {
    TurnedDetector turned([this](const cv::Mat& image) { return side_.detector->Detect(image); },
                          given_turn_);
    background_ =
        std::make_unique<BackgroundDetector>([this, turned](const cv::Mat& image) mutable {
          if (const int held = held_turn_; held >= 0) turned.SetHeldTurn(held);
          return turned(image, SteadySeconds());
        });
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

void FrameInputs::Read(size_t ahead) {
  while (read_.size() < ahead + 1) {
    std::optional<InputImage> image = NextReadable();
    if (!image) break;
    const bool is_chosen = Choose(*image);
    read_.push_back({std::move(*image), is_chosen});
    ++read_count_;
  }
  if (!pool_) return;
  InputImage last = last_looked_at_;
  for (ReadImage& read : read_) {
    if (!read.is_chosen || !IsWanted(read.image, last)) continue;
    last = read.image;
    if (read.found.valid()) continue;
    read.turn = TurnFor(read.image);
    read.found = pool_->Add(Turned(read.image.image, read.turn));
  }
}

bool FrameInputs::IsWanted(const InputImage& image, const InputImage& last) const {
  return !lost_since_s_ || detect_every_ > 0 || last.image.empty() ||
         HelpsLostCamera(image.timestamp - *lost_since_s_, image.timestamp - last.timestamp,
                         last.image, image.image);
}

void FrameInputs::SetState(TrackingState state) {
  if (!IsLost(state))
    lost_since_s_.reset();
  else if (!lost_since_s_)
    lost_since_s_ = given_s_;
}

int FrameInputs::TurnFor(const InputImage& image) {
  if (given_turn_) return *given_turn_;
  if (const auto known = KnownTurn(image, side_.gravity.At(image.timestamp))) return *known;
  if (turn_by_map_) return *turn_by_map_;
  return turn_by_boxes_ ? turn_by_boxes_->turn().value_or(0) : 0;
}

void FrameInputs::SetVertical(const std::optional<Vertical>& vertical) {
  if (!pool_ || !vertical) return;
  const std::optional<int> turn = UprightTurn(vertical->gravity_in_cam);
  if (!turn) return;
  if (vertical->is_measured)
    turn_by_map_ = turn;
  else if (turn_by_boxes_)
    turn_by_boxes_->SetHeldTurn(*turn);
}

void FrameInputs::DetectLate(int frame, const cv::Mat& image,
                             const std::optional<Vertical>& vertical) {
  if (!background_) return;
  // Where it is not known, the detector finds it.
  std::optional<int> known;
  if (const auto turn =
          given_turn_ || !vertical ? std::nullopt : UprightTurn(vertical->gravity_in_cam)) {
    if (vertical->is_measured)
      known = turn;
    else
      held_turn_ = *turn;
  }
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
  Read(most_ahead_);
  if (read_.empty()) return std::nullopt;
  ReadImage read = std::move(read_.front());
  read_.pop_front();
  const InputImage& image = read.image;
  FrameInput frame;
  frame.index = image.index;
  frame.name = image.name;
  frame.path = image.path;
  frame.orientation = image.orientation;
  given_s_ = image.timestamp;
  frame.taken_s = image.taken_s;
  frame.input.image = image.image;
  frame.input.timestamp = image.timestamp;
  frame.input.gravity_in_cam = side_.gravity.At(image.timestamp);
  if (depths_) frame.input.depth = depths_->Find(image.path.empty() ? image.name : image.path);
  const std::vector<ImuSample>& samples = side_.imu.samples;
  for (; given_samples_ < samples.size() &&
         samples[given_samples_].timestamp <= image.timestamp + Gyroscope::kMostOffset;
       ++given_samples_) {
    const ImuSample& sample = samples[given_samples_];
    if (side_.imu.has_acceleration)
      frame.input.imu.push_back(sample);
    else
      frame.input.angular_velocity.push_back(
          {sample.timestamp, side_.cam_from_imu.rotation * sample.angular_velocity});
  }
  if (background_) {
    frame.input.detections_follow = true;
  } else if (!pool_) {
    frame.input.detections = side_.detections.Find(image.path.empty() ? image.name : image.path);
  } else if (read.is_chosen && IsWanted(image, last_looked_at_)) {
    if (!IsReadyUnlessInterrupted(read.found)) return std::nullopt;
    frame.input.detections = read.found.get();
    TurnBack(read.turn, image.image.size(), frame.input.detections);
    last_looked_at_ = image;
    ++looked_at_;
  }
  return frame;
}

void FrameInputs::ReportSensors(const ImuCalibration& imu) const {
  const GyroscopeCalibration& known = imu.gyroscope;
  side_.gravity.WarnIfUnused();
  const std::vector<ImuSample>& samples = side_.imu.samples;
  if (samples.empty()) return;
  if (samples.front().timestamp > *last_timestamp_ ||
      samples.back().timestamp < *first_timestamp_) {
    spdlog::warn(
        "--imu: no sample near any image: it has {:.3f} to {:.3f} s, the images {:.3f} to {:.3f} s",
        samples.front().timestamp, samples.back().timestamp, *first_timestamp_, *last_timestamp_);
    return;
  }
  const Eigen::Vector3d bias = known.bias / kDegree;
  switch (known.state) {
    case GyroscopeState::kUnknown:
      spdlog::warn(
          "gyroscope: bias and clock not known at the end: the camera hardly turned, or few images "
          "that fit well had samples; {}",
          side_.axes);
      break;
    case GyroscopeState::kRefused:
      spdlog::warn(
          "gyroscope: refused at the end, most images contradict it: its axes, its unit (rad/s) or "
          "its clock (within {} s of the images') are wrong; {}",
          Gyroscope::kMostOffset, side_.axes);
      break;
    case GyroscopeState::kCalibrated:
      spdlog::info(
          "gyroscope: bias {:.3f} {:.3f} {:.3f} (sigma {:.3f}) deg/s, clock ahead by {:.1f} (sigma "
          "{:.1f}) ms; {}",
          bias.x(), bias.y(), bias.z(), known.sigma_bias / kDegree, 1e3 * known.offset_s,
          1e3 * known.sigma_offset_s, side_.axes);
  }
  if (!imu.problem.empty()) spdlog::warn("--imu: {}", imu.problem);
  if (!side_.imu.has_acceleration || imu.accelerometer == AccelerometerState::kRefused) return;
  if (imu.accelerometer == AccelerometerState::kUnknown)
    spdlog::warn("accelerometer: the length of a metre is not known at the end: {}",
                 known.state == GyroscopeState::kRefused
                     ? "it needs the gyroscope"
                     : "the camera has hardly been moved to and fro");
  else
    spdlog::info("accelerometer: bias {:.3f} {:.3f} {:.3f} m/s^2; metre +- {:.1f} %",
                 imu.acceleration_bias.x(), imu.acceleration_bias.y(), imu.acceleration_bias.z(),
                 100 * imu.sigma_metre);
}

}  // namespace oaslam::apps
