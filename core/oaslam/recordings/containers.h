#pragma once

#include <memory>
#include <string>

#include "oaslam/recordings/recording_reader.h"

namespace oaslam {

// A file of a recording, and what messages call it: itself, or the compressed file of which it is a
// copy. A copy has a path only as long as its descriptor is open, and no other name.
struct RecordingFile {
  std::string path, name;

  bool IsCopy() const { return path != name; }
};

struct WantedTopic {
  RecordedTopic topic;
  size_t wanted = 0;  // bytes of each message
};

// The readers of one file each, by its kind.
std::unique_ptr<RecordingReader> OpenMcap(const RecordingFile& file, BytesWanted wanted);
std::unique_ptr<RecordingReader> OpenRosBag(const RecordingFile& file, BytesWanted wanted);
std::unique_ptr<RecordingReader> OpenRosbagDatabase(const RecordingFile& file, BytesWanted wanted);

// The kinds of records in MCAP, https://mcap.dev/spec. Others are not of use here.
enum class McapRecord : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0b,
  kDataEnd = 0x0f
};

inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8), kBagMagic("#ROSBAG V2.0\n"),
    kSqliteMagic("SQLite format 3");

// "sensor_msgs/Image" of ROS 2's "sensor_msgs/msg/Image".
std::string PlainType(std::string type);

}  // namespace oaslam
