#include "oaslam/images/stream_clock.h"

#include <algorithm>

namespace oaslam {

StreamClock::Image StreamClock::Next(std::optional<double> stamp, double arrival) {
  // More than a stream pauses without its clock being set.
  constexpr double kLongestGap_s = 10;
  // Less than the images of any camera are apart.
  constexpr double kShortest_s = 1e-4;
  Image image{arrival, arrival};
  if (stamp) {
    if (!offset_ || *stamp < last_stamp_ || *stamp > last_stamp_ + kLongestGap_s)
      offset_ = fastest_ = arrival - *stamp;
    fastest_ = std::min(fastest_, arrival - *stamp);
    last_stamp_ = *stamp;
    image = {*stamp + *offset_, *stamp + fastest_};
  }
  if (!start_)
    start_ = image.timestamp;
  else
    image.timestamp = std::max(image.timestamp, last_ + kShortest_s);
  last_ = image.timestamp;
  image.timestamp -= *start_;
  return image;
}

}  // namespace oaslam
