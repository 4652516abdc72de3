#include "oaslam/ros2/robot_node.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "oaslam/geometry/angular_velocity_check.h"
#include "oaslam/images/bit_depth.h"
#include "oaslam/images/ros_pixels.h"
#include "oaslam/images/video_source.h"
#include "oaslam/odometry/gyroscope.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

constexpr double kPatience = 5;  // seconds that are waited for what should be there
constexpr std::chrono::milliseconds kSlice{100};  // between looks at what may end a wait

constexpr std::string_view kCompressed = "/compressed";
constexpr char kImage[] = "sensor_msgs/Image", kCompressedImage[] = "sensor_msgs/CompressedImage";

// camera_info beside the images, as image_transport has it.
std::string InfoBeside(std::string images) {
  if (images.ends_with(kCompressed)) images.resize(images.size() - kCompressed.size());
  return images.substr(0, images.rfind('/') + 1) + "camera_info";
}

bool IsRectified(const std::string& images) {
  const std::string base =
      images.ends_with(kCompressed) ? images.substr(0, images.size() - kCompressed.size()) : images;
  return base.substr(base.rfind('/') + 1).starts_with("image_rect");
}

RecordedTopic TopicFor(const std::string& name, const std::string& type) {
  return {name, type, MessageEncoding::kCdr, "cdr"};
}

RosHeader HeaderOf(const RecordedMessage& message) {
  return message.topic->type == kImage ? ReadRosImage(message, true).header
                                       : ReadRosCompressedImage(message, true).header;
}

template <typename Key, typename Value>
void KeepLast(std::map<Key, Value>& values) {
  constexpr size_t kMost = 1000;
  while (values.size() > kMost) values.erase(values.begin());
}

}  // namespace

std::vector<std::string> RobotNode::TopicNames() {
  return {"image",    "camera_info", "imu",     "tf",         "tf_static",  "pose",
          "odometry", "path",        "objects", "objects_3d", "detections", "status"};
}

RobotNode::RobotNode(const RobotOptions& options)
    : options_(options),
      image_topic_(options.names.TopicOf("image")),
      info_topic_(options.names.names.contains("camera_info") ? options.names.TopicOf("camera_info")
                                                              : InfoBeside(image_topic_)),
      imu_topic_(options.names.names.contains("imu") ? options.names.TopicOf("imu") : ""),
      dds_(std::make_unique<DdsNode>(options.domain)),
      results_(options.frames, [this](RobotTopic topic, const CdrWriter& message) {
        Write(topics_.at(topic), message);
      }) {
  constexpr TopicQuality kMoving{.depth = 100}, kLatched{.is_latched = true, .depth = 1}, kDefault;
  const auto publish = [&](const char* name, const char* type, const TopicQuality& quality) {
    return dds_->Publish(options_.names.TopicOf(name), type, quality);
  };
  topics_ = {
      {RobotTopic::kTransforms, publish("/tf", "tf2_msgs/TFMessage", kMoving)},
      {RobotTopic::kPose, publish("~/pose", "geometry_msgs/PoseWithCovarianceStamped", kDefault)},
      {RobotTopic::kOdometry, publish("~/odometry", "nav_msgs/Odometry", kDefault)},
      {RobotTopic::kPath, publish("~/path", "nav_msgs/Path", kLatched)},
      {RobotTopic::kMarkers, publish("~/objects", "visualization_msgs/MarkerArray", kLatched)},
      {RobotTopic::kObjects, publish("~/objects_3d", "vision_msgs/Detection3DArray", kLatched)}};
  detections_ = publish("~/detections", "vision_msgs/Detection2DArray", kDefault);
  status_topic_ = publish("~/status", "diagnostic_msgs/DiagnosticArray", kDefault);

  const auto read = [&](const std::string& topic, const char* type, const TopicQuality& quality,
                        auto take) {
    dds_->Read(TopicFor(topic, type), quality,
               [this, take](const RecordedMessage& message, uint64_t) {
                 try {
                   take(message);
                 } catch (const std::exception& error) {
                   const std::lock_guard lock(mutex_);
                   SayOnce(message.topic->name,
                           fmt::format("{}: {} (left out)", message.topic->name, error.what()));
                 }
               });
  };
  read(info_topic_, "sensor_msgs/CameraInfo", {.is_reliable = false, .depth = 5},
       [this](const RecordedMessage& m) { TakeInfo(m); });
  if (HasImu())
    read(imu_topic_, "sensor_msgs/Imu", {.is_reliable = false, .depth = 200},
         [this](const RecordedMessage& m) { TakeImuSample(m); });
  read(options_.names.TopicOf("/tf"), "tf2_msgs/TFMessage", kMoving,
       [this](const RecordedMessage& m) { TakeTransforms(m, false); });
  read(options_.names.TopicOf("/tf_static"), "tf2_msgs/TFMessage",
       {.is_latched = true, .depth = 100},
       [this](const RecordedMessage& m) { TakeTransforms(m, true); });

  status_.image_topic = image_topic_;
  status_.map = options_.frames.map;
  status_.odom = options_.frames.odom;
  status_.base = options_.frames.base;
  status_.wants_camera_tf = options_.frames.publishes_camera;
  status_.is_mapping = options_.is_mapping;
  began_s_ = SteadySeconds();
  thread_ = std::jthread([this](const std::stop_token& stop) { Work(stop); });
}

RobotNode::~RobotNode() { Leave(); }

void RobotNode::Leave() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  const std::lock_guard lock(mutex_);
  dds_.reset();
}

void RobotNode::Write(int topic, const CdrWriter& message) {
  if (dds_) dds_->Write(topic, message.bytes());
}

void RobotNode::SayOnce(const std::string& about, const std::string& text) {
  constexpr int kSaid = 1000;
  if (std::exchange(said_[about], kSaid) != kSaid) Log(LogLevel::kWarning, "{}", text);
}

void RobotNode::Work(const std::stop_token& stop) {
  constexpr double kWait = 0.05, kStatus = 1, kChoose = 0.5;  // seconds
  double next_status_s = began_s_ + kStatus, next_choice_s = 0;
  while (!stop.stop_requested()) {
    try {
      dds_->Wait(kWait);
      const double now = SteadySeconds();
      if (now >= next_choice_s) {
        next_choice_s = now + kChoose;
        ChooseImages();
      }
      if (now >= next_status_s) {
        next_status_s = std::max(next_status_s + kStatus, now);
        ReportStatus();
      }
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      SayOnce("work", error.what());
    }
  }
}

void RobotNode::ChooseImages() {
  std::vector<Publication> all = dds_->Publications();
  const auto offers = [&](const std::string& topic, const char* type) {
    return std::ranges::any_of(
        all, [&](const Publication& p) { return p.topic == topic && p.type == type; });
  };
  std::string topic = image_topic_, type;
  if (offers(topic, kImage)) {
    type = kImage;
  } else if (offers(topic, kCompressedImage)) {
    type = kCompressedImage;
  } else if (offers(topic + std::string(kCompressed), kCompressedImage)) {
    topic += kCompressed;
    type = kCompressedImage;
  }
  // A best-effort reader takes from all publishers, a reliable one gets what was lost once more.
  const bool is_reliable = std::ranges::all_of(all, [&](const Publication& p) {
    return p.topic != topic || p.type != type || p.is_reliable;
  });
  const bool is_new = !type.empty() && (topic != read_topic_ || type != read_type_ ||
                                        is_reliable != reads_reliably_);
  if (is_new) {
    dds_->Read(TopicFor(topic, type), {.is_reliable = is_reliable, .depth = is_reliable ? 10 : 5},
               [this](const RecordedMessage& message, uint64_t publisher) {
                 TakeImage(message, publisher);
               });
    Log(LogLevel::kInfo, "images of {} ({}, {})", topic, type,
        is_reliable ? "reliable" : "best effort");
  }
  const std::vector<uint64_t> publishers =
      type.empty() ? std::vector<uint64_t>() : dds_->Publishers(topic);
  const std::lock_guard lock(mutex_);
  if (is_new) read_topic_ = topic, read_type_ = type, reads_reliably_ = is_reliable;
  // Another one takes its place, such as a driver that was started again.
  if (publisher_ && std::ranges::count(publishers, *publisher_) == 0) publisher_.reset();
  status_.publishers = static_cast<int>(publishers.size());
  status_.image_topic = topic;
  status_.publications = std::move(all);
}

void RobotNode::TakeImage(const RecordedMessage& message, uint64_t publisher) {
  constexpr size_t kMostWaiting = 8;
  const std::lock_guard lock(mutex_);
  if (publisher_.value_or(publisher) != publisher) return;
  RosHeader header;
  try {
    header = HeaderOf(message);
  } catch (const std::exception&) {
    ++status_.unreadable;
    return;
  }
  last_image_s_ = SteadySeconds();
  if (first_image_s_ == 0) first_image_s_ = last_image_s_;
  if (header.frame.empty()) {
    header.frame = "camera_optical_frame";
    SayOnce("frame",
            fmt::format("{}: frame_id is empty: taken for {}", message.topic->name, header.frame));
  }
  const ImageClock::Step step = clock_.Add(header.stamp);
  status_.missed = clock_.missed();
  if (step == ImageClock::Step::kNone) {
    ++status_.without_stamp;
    return;
  }
  if (step == ImageClock::Step::kNotNew) {
    ++status_.out_of_order;
    return;
  }
  publisher_ = publisher;
  const int index = count_++;
  if (step == ImageClock::Step::kBack) {
    Log(LogLevel::kWarning,
        "{}: the time went back, as where a bag is played again: the camera is looked for in the "
        "map",
        message.topic->name);
    ++status_.clock_jumps;
    begun_anew_.insert(index);
    transforms_.ForgetMoving();
    results_.Forget();
  }
  ++status_.images;
  camera_frame_ = status_.camera = header.frame;
  headers_[index] = {header.stamp, header.frame};
  KeepLast(headers_);
  Received image{index, clock_.Seconds(header.stamp), last_image_s_, *message.topic,
                 ByteBuffer(message.data.begin(), message.data.end())};
  images_.push_back(std::move(image));
  if (images_.size() > kMostWaiting) images_.pop_front();
  arrived_.notify_all();
}

void RobotNode::TakeInfo(const RecordedMessage& message) {
  const std::lock_guard lock(mutex_);
  ++infos_;
  if (info_ && info_->IsCalibrated()) return;
  info_ = ReadRosCameraInfo(message);
  arrived_.notify_all();
}

void RobotNode::TakeImuSample(const RecordedMessage& message) {
  constexpr size_t kMost = 20000;
  constexpr int64_t kSecond = 1'000'000'000;
  const RosImu sample = ReadRosImu(message);
  const std::lock_guard lock(mutex_);
  if (sample.header.stamp == 0) {
    SayOnce("imu", imu_topic_ + ": the samples have no time stamp (0) and are left out");
    return;
  }
  // One bad sample must not end the run: Slam refuses images that come with such ones.
  std::string problem = ProblemOf({0, sample.angular_velocity}, nullptr);
  if (problem.empty()) problem = ProblemOfAcceleration(sample.acceleration);
  if (!problem.empty()) {
    SayOnce("imu values", fmt::format("{}: a sample is left out: {}", imu_topic_, problem));
    return;
  }
  imu_frame_ = sample.header.frame;
  const int64_t later = imu_.empty() ? 1 : sample.header.stamp - imu_.back().first;
  if (later < -kSecond) imu_.clear();  // its clock began anew
  if (later <= 0 && !imu_.empty()) return;
  imu_.push_back({sample.header.stamp, {0, sample.angular_velocity, sample.acceleration}});
  if (imu_.size() > kMost) imu_.pop_front();
}

void RobotNode::TakeTransforms(const RecordedMessage& message, bool is_static) {
  const std::vector<RosTransform> all = ReadRosTransforms(message);
  const std::lock_guard lock(mutex_);
  for (const RosTransform& transform : all)
    // What this node publishes comes back.
    if (transform.parent != options_.frames.map) transforms_.Add(transform, is_static);
  results_.Place(transforms_);
  arrived_.notify_all();
}

void RobotNode::ReportStatus() {
  using Known = RobotStatus::Known;
  constexpr int kLasting = 3;  // reports
  const std::lock_guard lock(mutex_);
  const double now = SteadySeconds();
  const auto known = [](bool is_connected, bool waits) {
    return !is_connected ? Known::kNot : waits ? Known::kAtOtherTimes : Known::kNow;
  };
  const std::string camera = camera_frame_.value_or(""), &base = options_.frames.base;
  status_.base_from_camera = known(transforms_.Connects(base, camera), results_.WaitsForBase());
  status_.odom_from_base =
      known(transforms_.Connects(options_.frames.odom, base), results_.WaitsForOdom());
  const auto base_from_cam = transforms_.Find(base, camera, clock_.newest());
  status_.has_optical_axes = !base_from_cam || base == camera || !HasAxesOfBase(*base_from_cam);
  status_.camera_has_parent = transforms_.HasParent(camera);
  constexpr double kStretch = 4;  // seconds
  if (now - stretch_.since_s > kStretch) {
    status_.recent_images = status_.images - stretch_.images;
    status_.recent_infos = infos_ - stretch_.infos;
    stretch_ = {now, status_.images, infos_};
  }
  if (status_.images + status_.without_stamp > 0) status_.silence_s = now - last_image_s_;
  Write(status_topic_, DiagnosticsMessage(clock_.newest(), {DiagnosticOf(status_)}));
  std::set<std::string> present;
  for (const std::string& problem : ProblemsOf(status_)) {
    std::string kind = problem;  // with other numbers it is the same problem
    std::erase_if(kind, [](unsigned char c) { return std::isdigit(c) != 0; });
    present.insert(kind);
    if (++said_[kind] == kLasting) Log(LogLevel::kWarning, "{}", problem);
  }
  std::erase_if(said_, [&](const auto& kind) {
    return kind.second < kLasting && !present.contains(kind.first);
  });
}

// The images as SLAM takes them.
class RobotNode::Images : public ImageSource {
 public:
  Images(RobotNode& node, const ImageSourceOptions& options) : node_(node), options_(options) {}

  std::optional<InputImage> Next() override {
    while (true) {
      std::optional<Received> received = Wait();
      if (!received || (options_.to >= 0 && received->index >= options_.to)) return std::nullopt;
      if (received->index < options_.from) continue;
      InputImage image{.index = received->index,
                       .timestamp = received->seconds,
                       .name = NameOfVideoImage(received->index),
                       .image = {},
                       .taken_s = received->arrived_s};
      try {
        image.image = Pixels({&received->topic, 0, received->message});
      } catch (const InputError& error) {
        // A single message may be damaged; where all are, it is an encoding that is not read.
        constexpr int kTries = 5;
        if (!has_read_ && ++failed_ >= kTries)
          throw BadInput("{}: {}", received->topic.name, error.what());
      }
      if (!image.image.empty()) {
        has_read_ = true;
        return image;
      }
      const std::lock_guard lock(node_.mutex_);
      ++node_.status_.unreadable;
    }
  }
  int size() const override { return -1; }
  void Stop() override {
    is_stopped_ = true;
    node_.arrived_.notify_all();
  }

 private:
  std::optional<Received> Wait() {
    std::unique_lock lock(node_.mutex_);
    while (node_.images_.empty()) {
      if (is_stopped_ || (options_.stopped && options_.stopped())) return std::nullopt;
      node_.arrived_.wait_for(lock, kSlice);
    }
    Received image = std::move(node_.images_.front());
    node_.images_.pop_front();
    return image;
  }

  cv::Mat Pixels(const RecordedMessage& message) {
    const bool color = options_.color || options_.color_if_free;
    if (message.topic->type != kImage)
      return PixelsOf(ReadRosCompressedImage(message, false), color);
    const RosImage image = ReadRosImage(message, false);
    if (image.encoding == "mono16") bits_ = std::max(bits_, UsedBits(ValuesOf(image)));
    return PixelsOf(image, color, bits_);
  }

  RobotNode& node_;
  ImageSourceOptions options_;
  std::atomic<bool> is_stopped_ = false;
  bool has_read_ = false;
  int failed_ = 0;  // images, before the first that was read
  int bits_ = 8;    // that images of 16 have used so far
};

std::unique_ptr<ImageSource> RobotNode::OpenImages(const ImageSourceOptions& options) {
  return std::make_unique<Images>(*this, options);
}

std::optional<Camera> RobotNode::WaitForCamera() {
  std::unique_lock lock(mutex_);
  while (images_.empty()) arrived_.wait_for(lock, kSlice);
  while ((!info_ || (HasImu() && !FindImu())) && SteadySeconds() < first_image_s_ + kPatience)
    arrived_.wait_for(lock, kSlice);
  if (!info_) {
    std::set<std::string> others;
    for (const Publication& p : status_.publications)
      if (p.type == "sensor_msgs/CameraInfo") others.insert(p.topic);
    Log(LogLevel::kWarning, "{}: no CameraInfo has come: the lens is estimated from the images{}",
        info_topic_,
        others.empty() ? ""
                       : fmt::format("; camera_info:=TOPIC takes {}", fmt::join(others, ", ")));
    return std::nullopt;
  }
  std::optional<Camera> camera;
  try {
    camera = CameraOfInfo(*info_, IsRectified(read_topic_), info_topic_);
  } catch (const InputError& error) {
    Log(LogLevel::kWarning, "{}: the lens is estimated from the images", error.what());
    return std::nullopt;
  }
  if (camera)
    Log(LogLevel::kInfo, "camera: {}{}", info_topic_,
        IsRectified(read_topic_) ? " (P, of rectified images)" : "");
  else
    Log(LogLevel::kWarning, "{}: is not calibrated (K is 0): the lens is estimated from the images",
        info_topic_);
  return camera;
}

std::optional<Rigid3> RobotNode::FindImu() const {
  if (!camera_frame_ || imu_frame_.empty()) return std::nullopt;
  return transforms_.Find(*camera_frame_, imu_frame_, clock_.newest());
}

std::optional<Rigid3> RobotNode::WaitForImu() {
  std::unique_lock lock(mutex_);
  std::optional<Rigid3> found = FindImu();
  for (; !found && SteadySeconds() < first_image_s_ + kPatience; found = FindImu())
    arrived_.wait_for(lock, kSlice);
  return found;
}

std::vector<ImuSample> RobotNode::TakeImu(double seconds) {
  const std::lock_guard lock(mutex_);
  std::vector<ImuSample> samples;
  while (!imu_.empty()) {
    ImuSample sample = imu_.front().second;
    sample.timestamp = clock_.Seconds(imu_.front().first);
    if (sample.timestamp > seconds + Gyroscope::kMostOffset) break;
    samples.push_back(sample);
    imu_.pop_front();
  }
  return samples;
}

bool RobotNode::BeganAnew(int image) {
  const std::lock_guard lock(mutex_);
  // Images may be left out, also the first of a pass.
  const auto end = begun_anew_.upper_bound(image);
  const bool has = end != begun_anew_.begin();
  begun_anew_.erase(begun_anew_.begin(), end);
  return has;
}

void RobotNode::Publish(const RobotResult& result, const ClassNames& names) {
  const std::lock_guard lock(mutex_);
  const auto image = headers_.find(result.image);
  if (image == headers_.end()) return;
  frames_[result.frame] = image->second;
  KeepLast(frames_);
  status_.has_result = true;
  status_.state = result.state;
  status_.has_pose = result.world_from_cam.has_value();
  status_.imu_problem = result.imu_problem;
  status_.is_metric = result.map && result.map->is_metric;
  results_.Add(result, image->second, clock_, transforms_, names);
}

void RobotNode::PublishDetections(int frame, const std::vector<Detection>& detections,
                                  const ClassNames& names) {
  const std::lock_guard lock(mutex_);
  if (const auto header = frames_.find(frame); header != frames_.end())
    Write(detections_, DetectionsMessage(header->second, detections, names));
}

}  // namespace oaslam
