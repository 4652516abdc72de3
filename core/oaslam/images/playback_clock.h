#pragma once

#include <algorithm>
#include <optional>

namespace oaslam {

// Plays a recording at the speed of its time stamps. Times are in seconds of one clock.
class PlaybackClock {
 public:
  // The time at which the next image is due. A gap of more than 2 s in the recording shows nothing,
  // and is played as one of 2 s.
  double Due(double timestamp, double now) {
    constexpr double kLongestWait_s = 2;
    if (!start_) start_ = now - timestamp;
    const double skipped = std::max(*start_ + timestamp - now - kLongestWait_s, 0.0);
    *start_ -= skipped;
    return *start_ + timestamp;
  }
  // Delays all images that follow, after the playback was paused.
  void Delay(double seconds) {
    if (start_) *start_ += seconds;
  }

 private:
  std::optional<double> start_;  // when the image of the time stamp 0 is due
};

}  // namespace oaslam
