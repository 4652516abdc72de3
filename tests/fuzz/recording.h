#pragma once

#include <opencv2/core.hpp>

#include "fuzz.h"
#include "oaslam/images/ros_pixels.h"
#include "oaslam/log.h"
#include "oaslam/recordings/topic_choice.h"

namespace oaslam::fuzz {

// The content of a message, as its topic says.
inline void DecodeMessage(const RecordedMessage& message) {
  if (message.topic->type == "sensor_msgs/Image") {
    const RosImage image = ReadRosImage(message, false);
    Try([&] { PixelsOf(image, true, 12); });
    ValuesOf(image);
  } else if (message.topic->type == "sensor_msgs/CompressedImage") {
    ReadRosCompressedImage(message, false);
  }
}

// Reads a recording, whose file begins with `magic`, in each way.
inline int ReadRecording(std::string_view magic, std::string_view rest) {
  SetLogSink({});
  const std::string path = FileOf(std::string(magic).append(rest), "recording");
  Try([&] {
    const auto reader = OpenRecording(path, [](const RecordedTopic&) { return kWholeMessage; });
    while (const auto message = reader->Next()) Try([&] { DecodeMessage(*message); });
  });
  return Try([&] {
    const RecordingSummary summary = Summarize(path);
    TopicLines(summary);
    ChooseImu(summary);
    const TopicSummary& images = ChooseImages(summary, "");
    ChooseDepths(summary, images);
    CameraOf(summary, images);
  });
}

}  // namespace oaslam::fuzz
