#include "oaslam/images/recorded_images.h"

#include <algorithm>

#include "oaslam/images/bit_depth.h"
#include "oaslam/images/ros_pixels.h"
#include "oaslam/images/video_source.h"
#include "oaslam/recordings/topic_choice.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Opens a recording for the messages of one topic.
std::unique_ptr<RecordingReader> OpenTopic(const std::string& path, const std::string& topic) {
  return OpenRecording(path, [topic](const RecordedTopic& other) {
    return other.name == topic ? kWholeMessage : 0;
  });
}

// How many bits the first images use; of a single one, the rest might use more.
int BitsOfFirst(const std::string& path, const std::string& topic) {
  constexpr int kImages = 10, kLeast = 8;
  const std::unique_ptr<RecordingReader> reader = OpenTopic(path, topic);
  int bits = kLeast, seen = 0;
  while (seen < kImages) {
    const std::optional<RecordedMessage> message = reader->Next();
    if (!message) break;
    if (message->topic->name != topic) continue;
    ++seen;
    Decode(*reader, *message,
           [&] { bits = std::max(bits, UsedBits(ValuesOf(ReadRosImage(*message, false)))); });
  }
  return bits;
}

class RecordedImages : public ImageSource {
 public:
  RecordedImages(const std::string& path, const TopicSummary& topic,
                 const ImageSourceOptions& options)
      : topic_(topic.topic.name),
        options_(options),
        end_(options.to < 0 ? static_cast<int>(topic.times.size())
                            : std::min(options.to, static_cast<int>(topic.times.size()))),
        bits_(topic.format == "mono16" ? BitsOfFirst(path, topic_) : 16),
        reader_(OpenTopic(path, topic_)) {}

  std::optional<InputImage> Next() override {
    while (next_ < end_) {
      const std::optional<RecordedMessage> message = reader_->Next();
      if (!message) break;
      if (message->topic->name != topic_ || next_++ < options_.from) continue;
      return Decode(*reader_, *message, [&] { return Read(*message, next_ - 1); });
    }
    return std::nullopt;
  }
  int size() const override { return end_ - options_.from; }

 private:
  InputImage Read(const RecordedMessage& message, int index) const {
    const bool color = options_.color || options_.color_if_free;
    InputImage read{.index = index, .name = NameOfVideoImage(index), .image = {}};
    RosHeader header;
    if (message.topic->type == "sensor_msgs/Image") {
      const RosImage image = ReadRosImage(message, false);
      header = image.header;
      read.image = PixelsOf(image, color, bits_);
    } else {
      const RosCompressedImage image = ReadRosCompressedImage(message, false);
      header = image.header;
      read.image = PixelsOf(image, color);
    }
    read.timestamp = options_.fps ? index / *options_.fps : TimeOf(header, message);
    return read;
  }

  std::string topic_;
  ImageSourceOptions options_;
  int end_, next_ = 0;
  int bits_;
  std::unique_ptr<RecordingReader> reader_;
};

}  // namespace

std::unique_ptr<ImageSource> OpenRecordedImages(const std::string& path,
                                                const ImageSourceOptions& options) {
  if (options.time_unit)
    throw BadInput("{}: --time-unit: a recording of ROS tells the unit of its times", path);
  const std::shared_ptr<const RecordingSummary> summary = SummaryOf(path);
  const TopicSummary& topic = ChooseImages(*summary, options.topic);
  if (options.from >= static_cast<int>(topic.times.size()))
    throw BadInput("--from {}: {} has {} images", options.from, path, topic.times.size());
  if (topic.without_stamp > 0 && !options.fps && !options.quiet)
    Log(LogLevel::kWarning,
        "{}: {}: {} of {} headers have no time stamp: the times at which they were recorded are "
        "used",
        path, topic.topic.name, topic.without_stamp, topic.messages);
  return std::make_unique<RecordedImages>(path, topic, options);
}

std::vector<ListedImage> TimesOfRecordedImages(const std::string& path,
                                               const ImageSourceOptions& options) {
  const std::shared_ptr<const RecordingSummary> summary = SummaryOf(path);
  std::vector<ListedImage> images;
  for (const double time : ChooseImages(*summary, options.topic).times) {
    const int i = static_cast<int>(images.size());
    images.push_back({options.fps ? i / *options.fps : time, NameOfVideoImage(i)});
  }
  return images;
}

}  // namespace oaslam
