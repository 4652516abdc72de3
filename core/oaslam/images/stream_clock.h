#pragma once

#include <optional>

namespace oaslam {

// The times of a live stream's images, of its own time stamps and of when they arrive. All times in
// seconds; arrivals are of one steady clock.
class StreamClock {
 public:
  struct Image {
    double timestamp = 0;  // since the first image, strictly ascending
    // Of the steady clock: when it was taken, or later. The stream does not tell how long its
    // fastest image took.
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
