#include "oaslam/images/recorded_depths.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "oaslam/images/ros_pixels.h"
#include "oaslam/recordings/recording_summary.h"

namespace oaslam {
namespace {

constexpr double kMostApart = 0.02;  // seconds, as for files

}  // namespace

RecordedDepths::RecordedDepths(const std::string& path, const std::string& topic)
    : path_(path),
      topic_(topic),
      reader_(OpenRecording(
          path,
          [topic](const RecordedTopic& other) { return other.name == topic ? kWholeMessage : 0; })),
      next_(Read()) {}

std::optional<RecordedDepths::Timed> RecordedDepths::Read() {
  while (const std::optional<RecordedMessage> message = reader_->Next()) {
    if (message->topic->name != topic_) continue;
    return Decode(*reader_, *message, [&] {
      const RosImage image = ReadRosImage(*message, false);
      return Timed{TimeOf(image.header, *message), ValuesOf(image)};
    });
  }
  return std::nullopt;
}

cv::Mat RecordedDepths::Near(double time) {
  while (next_ && next_->time < time) {
    before_ = std::move(next_);
    next_ = Read();
  }
  const bool is_before = before_ && (!next_ || time - before_->time < next_->time - time);
  const std::optional<Timed>& nearest = is_before ? before_ : next_;
  return nearest && std::abs(nearest->time - time) <= kMostApart ? nearest->image : cv::Mat();
}

bool RecordedDepths::HasAny(const std::vector<ListedImage>& images) const {
  const auto summary = SummaryOf(path_);
  const std::vector<double>& recorded = summary->Find(topic_)->times;
  const std::set<double> times(recorded.begin(), recorded.end());
  return std::ranges::any_of(images, [&](const ListedImage& image) {
    const auto next = times.lower_bound(image.timestamp - kMostApart);
    return next != times.end() && *next <= image.timestamp + kMostApart;
  });
}

}  // namespace oaslam
