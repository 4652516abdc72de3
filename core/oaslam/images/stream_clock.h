#pragma once

#include <optional>

namespace oaslam {

// Computes the times of a live stream's images from the stream's own time stamps and from the
// images' arrival times. All times in seconds; arrivals are of one steady clock.
class StreamClock {
 public:
  struct Image {
    double timestamp = 0;  // since the first image, strictly ascending
    // When the image was taken, or a little later, by the steady clock: the delay of the fastest
    // image is not known, and counts as 0.
    double taken = 0;
  };

  // `stamp`: the stream's own time of the image, of any origin; nothing where it has none.
  Image Next(std::optional<double> stamp, double arrival);
  // The stream begins again, with time stamps of another origin.
  void Restart() { offset_.reset(); }

 private:
  std::optional<double> start_, offset_;  // offset: from the stream's time to the steady clock
  double fastest_ = 0;                    // the smallest offset since the stream began
  double last_stamp_ = 0, last_ = 0;
};

}  // namespace oaslam
