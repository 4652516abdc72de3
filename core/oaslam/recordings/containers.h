#pragma once

#include <memory>
#include <string>

#include "oaslam/recordings/recording_reader.h"

namespace oaslam {

// A file of a recording, and what messages call it.
struct RecordingFile {
  std::string path, name;
};

// The readers of one file each, by its kind.
std::unique_ptr<RecordingReader> OpenMcap(const RecordingFile& file, BytesWanted wanted);
std::unique_ptr<RecordingReader> OpenRosBag(const RecordingFile& file, BytesWanted wanted);
std::unique_ptr<RecordingReader> OpenRosbagDatabase(const RecordingFile& file, BytesWanted wanted);

inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8), kBagMagic("#ROSBAG V2.0\n"),
    kSqliteMagic("SQLite format 3");

// "sensor_msgs/Image" of ROS 2's "sensor_msgs/msg/Image".
std::string PlainType(std::string type);

}  // namespace oaslam
