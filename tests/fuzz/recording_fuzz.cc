#include <opencv2/core.hpp>

#include "fuzz.h"
#include "oaslam/images/ros_pixels.h"
#include "oaslam/log.h"
#include "oaslam/recordings/topic_choice.h"

namespace {

// The content of a message, as its topic says.
void DecodeMessage(const oaslam::RecordedMessage& message) {
  using namespace oaslam;
  if (message.topic->type == "sensor_msgs/Image") {
    const RosImage image = ReadRosImage(message, false);
    fuzz::Try([&] { PixelsOf(image, true, 12); });
    ValuesOf(image);
  } else if (message.topic->type == "sensor_msgs/CompressedImage") {
    ReadRosCompressedImage(message, false);
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  oaslam::SetLogSink({});
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  const std::string path = fuzz::FileOf(fuzz::Text(data, size), "recording");
  fuzz::Try([&] {
    const auto reader = OpenRecording(path, [](const RecordedTopic&) { return kWholeMessage; });
    while (const auto message = reader->Next()) fuzz::Try([&] { DecodeMessage(*message); });
  });
  return fuzz::Try([&] {
    const RecordingSummary summary = Summarize(path);
    TopicLines(summary);
    ChooseImu(summary);
    const TopicSummary& images = ChooseImages(summary, "");
    ChooseDepths(summary, images);
    CameraOf(summary, images);
  });
}
