#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "oaslam/map/frame.h"

namespace oaslam {

// Keeps frames with their features for a second attempt at tracking once the map is complete: those
// that were not tracked by points, some before and after each such gap, and the newest frames.
class PassedFrames {
 public:
  // Adds the next frame.
  void Add(const Frame& frame, bool is_tracked);
  // All frames kept, in order.
  std::vector<Frame> All() const;
  void Clear();

 private:
  struct Passed {
    Frame frame;
    bool is_tracked = false;
  };
  std::deque<Passed> kept_, recent_;
  std::optional<int> last_lost_;  // the newest frame older than `recent_` that was not tracked
};

}  // namespace oaslam
