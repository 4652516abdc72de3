#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "oaslam/recordings/record_bytes.h"

namespace oaslam {

enum class MessageEncoding { kCdr, kRos1, kOther };

struct RecordedTopic {
  std::string name;  // "/camera/image_raw"
  std::string type;  // "sensor_msgs/Image", in ROS 2 without "msg/"
  MessageEncoding encoding = MessageEncoding::kOther;
  std::string encoding_name;  // as the recording has it, for messages to people
};

struct RecordedMessage {
  const RecordedTopic* topic = nullptr;
  int64_t log_time = 0;  // when it was recorded, nanoseconds
  // As many of its first bytes as were asked for; valid until the next message is read.
  ByteView data;
};

// How many bytes of the messages of a topic are read, at most.
using BytesWanted = std::function<size_t(const RecordedTopic&)>;
inline constexpr size_t kWholeMessage = SIZE_MAX;

// The messages of a recording in the order in which they were recorded.
class RecordingReader {
 public:
  virtual ~RecordingReader() = default;
  // Nothing at the end, which is also where a recording ends early: then `problem` tells that.
  // Throws InputError, with file and offset, where the recording is damaged.
  virtual std::optional<RecordedMessage> Next() = 0;
  // Where the last message is, for messages to people.
  virtual std::string Place() const = 0;
  // A sentence on a recording that ends early; empty: it does not.
  const std::string& problem() const { return problem_; }

 protected:
  std::string problem_;
};

// Whether a path is a recording: an MCAP file, a ROS 1 bag, a database of rosbag2 or one of these
// compressed as a whole (.zstd, .zst), or the folder of a rosbag2, also one without metadata.yaml,
// or this file of it.
bool IsRecording(const std::string& given);

// What changes with the content of a recording or a file of it, as far as the file system knows.
std::string StateOfRecording(const std::string& given);

// Opens a recording. Nothing is written beside it. A file that was compressed as a whole is read
// from a copy without a name in the folder of temporary files; copies are kept for who opens the
// recording next. Any thread may call it. Throws InputError where it cannot be read.
std::unique_ptr<RecordingReader> OpenRecording(const std::string& given, BytesWanted wanted);

}  // namespace oaslam
