#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/formats/imu_table.h"
#include "oaslam/recordings/ros_messages.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

enum class TopicKind {
  kOther,
  kImage,
  kCompressedImage,
  kCameraInfo,
  kImu,
  kTransforms,
  kDetections
};

// What a topic of a recording has in it. What of it is filled in depends on its kind.
struct TopicSummary {
  RecordedTopic topic;
  TopicKind kind = TopicKind::kOther;
  uint64_t messages = 0;
  double first_s = 0, last_s = 0;  // when the first and the last were recorded
  std::string frame;               // of the first message
  // Of images, IMUs and detections: the time of each message, which is that of its header, or that
  // of the record where the header has none.
  std::vector<double> times;
  uint64_t without_stamp = 0;  // how many headers have none
  // Of images: the encoding or format, and the size, of the first.
  std::string format;
  uint32_t width = 0, height = 0;
  std::optional<RosCameraInfo> info{};    // the first that is calibrated, else the first
  SensorSeries gyroscope, accelerometer;  // empty where all values are 0
  std::vector<RosDetections> detections;
  std::string problem;  // of the first message that cannot be read; later ones are not used

  // Messages a second; 0 where there are too few.
  double Rate() const {
    return messages > 1 && last_s > first_s ? static_cast<double>(messages - 1) / (last_s - first_s)
                                            : 0;
  }
};

// What is in a recording.
struct RecordingSummary {
  std::string path;
  std::vector<TopicSummary> topics;      // by their names
  std::vector<RosTransform> transforms;  // of /tf_static

  // The topic of this name, also without the slash at its beginning; null: there is none.
  const TopicSummary* Find(const std::string& name) const;
  // The pose of the frame `from` in the frame `to` by the static transforms; nothing where these do
  // not tell.
  std::optional<Rigid3> Between(const std::string& to, const std::string& from) const;
};

// Looks through a recording. Warns where it ends early. Throws InputError, with file and offset,
// where it is damaged.
RecordingSummary Summarize(const std::string& path);
// The same, kept for who asks for the same recording next.
std::shared_ptr<const RecordingSummary> SummaryOf(const std::string& path);

// The time of a message in seconds: that of its header, or that of the record.
double TimeOf(const RosHeader& header, const RecordedMessage& message);

// Calls `read`, and adds to what it throws where the message is.
template <typename Read>
auto Decode(const RecordingReader& reader, const RecordedMessage& message, Read read) {
  try {
    return read();
  } catch (const InputError& error) {
    throw BadInput("{}: {}: {}", reader.Place(), message.topic->name, error.what());
  }
}

}  // namespace oaslam
