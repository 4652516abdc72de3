#include "oaslam/recordings/recording_summary.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <ranges>

#include "oaslam/util/log.h"

namespace oaslam {
namespace {

double InSeconds(int64_t nanoseconds) {
  constexpr int64_t kSecond = 1'000'000'000;
  return static_cast<double>(nanoseconds / kSecond) +
         1e-9 * static_cast<double>(nanoseconds % kSecond);
}

TopicKind KindOf(const RecordedTopic& topic) {
  if (topic.encoding == MessageEncoding::kOther) return TopicKind::kOther;
  if (topic.type == "sensor_msgs/Image") return TopicKind::kImage;
  if (topic.type == "sensor_msgs/CompressedImage") return TopicKind::kCompressedImage;
  if (topic.type == "sensor_msgs/CameraInfo") return TopicKind::kCameraInfo;
  if (topic.type == "sensor_msgs/Imu") return TopicKind::kImu;
  if (topic.type == "vision_msgs/Detection2DArray") return TopicKind::kDetections;
  const bool is_tf = topic.type == "tf2_msgs/TFMessage" || topic.type == "tf/tfMessage";
  return is_tf && topic.name.ends_with("tf_static") ? TopicKind::kTransforms : TopicKind::kOther;
}

// Of images the first bytes tell time, size and encoding.
size_t BytesForSummary(const RecordedTopic& topic) {
  constexpr size_t kHead = 2048;
  switch (KindOf(topic)) {
    case TopicKind::kOther:
      return 0;
    case TopicKind::kImage:
    case TopicKind::kCompressedImage:
      return kHead;
    default:
      return kWholeMessage;
  }
}

class SummaryMaker {
 public:
  void Add(const RecordingReader& reader, const RecordedMessage& message) {
    TopicSummary& topic = topics_[message.topic->name];
    const double time = InSeconds(message.log_time);
    if (topic.messages++ == 0) {
      topic.topic = *message.topic;
      topic.kind = KindOf(topic.topic);
      topic.first_s = time;
    }
    topic.last_s = time;
    if (!topic.problem.empty()) return;
    try {
      AddContent(message, topic);
    } catch (const InputError& error) {
      topic.problem = fmt::format("{}: {}", reader.Place(), error.what());
    }
  }

  RecordingSummary Finish(const std::string& path) {
    RecordingSummary summary{.path = path, .topics = {}, .transforms = std::move(transforms_)};
    for (auto& [name, topic] : topics_) summary.topics.push_back(std::move(topic));
    return summary;
  }

 private:
  void AddTime(const RosHeader& header, const RecordedMessage& message, TopicSummary& topic) {
    if (topic.times.empty()) topic.frame = header.frame;
    topic.times.push_back(TimeOf(header, message));
    topic.without_stamp += header.stamp == 0;
  }

  void AddContent(const RecordedMessage& message, TopicSummary& topic) {
    switch (topic.kind) {
      case TopicKind::kImage: {
        const RosImage image = ReadRosImage(message, true);
        if (topic.times.empty())
          topic.format = image.encoding, topic.width = image.width, topic.height = image.height;
        return AddTime(image.header, message, topic);
      }
      case TopicKind::kCompressedImage: {
        const RosCompressedImage image = ReadRosCompressedImage(message, true);
        if (topic.times.empty()) topic.format = image.format;
        return AddTime(image.header, message, topic);
      }
      case TopicKind::kCameraInfo:
        if (topic.info && topic.info->IsCalibrated()) return;
        topic.info = ReadRosCameraInfo(message);
        topic.frame = topic.info->header.frame;
        return;
      case TopicKind::kImu:
        return AddImu(message, topic);
      case TopicKind::kTransforms:
        std::ranges::move(ReadRosTransforms(message), std::back_inserter(transforms_));
        return;
      case TopicKind::kDetections:
        topic.detections.push_back(ReadRosDetections(message));
        return AddTime(topic.detections.back().header, message, topic);
      case TopicKind::kOther:
        return;
    }
  }

  // A sensor of its own has zeros for what it does not measure.
  void AddImu(const RecordedMessage& message, TopicSummary& topic) {
    const RosImu imu = ReadRosImu(message);
    AddTime(imu.header, message, topic);
    const auto add = [&](const Eigen::Vector3d& value, SensorSeries& series) {
      if (series.times.empty() && value.isZero(0)) return;
      series.times.push_back(topic.times.back());
      series.values.push_back(value);
      series.lines.push_back(static_cast<size_t>(topic.messages));
    };
    add(imu.angular_velocity, topic.gyroscope);
    add(imu.acceleration, topic.accelerometer);
  }

  std::map<std::string, TopicSummary> topics_;
  std::vector<RosTransform> transforms_;
};

}  // namespace

const TopicSummary* RecordingSummary::Find(const std::string& name) const {
  for (const TopicSummary& topic : topics)
    if (topic.topic.name == name ||
        (topic.topic.name.starts_with('/') && topic.topic.name.substr(1) == name))
      return &topic;
  return nullptr;
}

std::optional<Rigid3> RecordingSummary::Between(const std::string& to,
                                                const std::string& from) const {
  std::map<std::string, Rigid3> to_from = {{to, Rigid3()}};
  std::vector<std::string> left = {to};
  while (!left.empty() && !to_from.contains(from)) {
    const std::string frame = left.back();
    left.pop_back();
    const auto add = [&](const std::string& next, const Rigid3& frame_from_next) {
      if (to_from.emplace(next, to_from.at(frame) * frame_from_next).second) left.push_back(next);
    };
    // A later one takes the place of an earlier one.
    for (const RosTransform& transform : transforms | std::views::reverse) {
      if (transform.parent == frame) add(transform.child, transform.parent_from_child);
      if (transform.child == frame) add(transform.parent, transform.parent_from_child.Inverse());
    }
  }
  const auto found = to_from.find(from);
  return found == to_from.end() ? std::nullopt : std::optional(found->second);
}

RecordingSummary Summarize(const std::string& path) {
  const std::unique_ptr<RecordingReader> reader = OpenRecording(path, BytesForSummary);
  SummaryMaker maker;
  while (const std::optional<RecordedMessage> message = reader->Next())
    maker.Add(*reader, *message);
  if (!reader->problem().empty()) Log(LogLevel::kWarning, "{}", reader->problem());
  return maker.Finish(path);
}

std::shared_ptr<const RecordingSummary> SummaryOf(const std::string& path) {
  static std::mutex mutex;
  static std::string state_of_last;
  static std::shared_ptr<const RecordingSummary> last;
  const std::string state = StateOfRecording(path);
  if (const std::lock_guard lock(mutex); last && state == state_of_last) return last;
  // Without the lock: it may log.
  auto summary = std::make_shared<const RecordingSummary>(Summarize(path));
  const std::lock_guard lock(mutex);
  state_of_last = state;
  return last = std::move(summary);
}

double TimeOf(const RosHeader& header, const RecordedMessage& message) {
  return InSeconds(header.stamp != 0 ? header.stamp : message.log_time);
}

}  // namespace oaslam
