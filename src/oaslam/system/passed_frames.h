#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "oaslam/map/frame.h"

namespace oaslam {

// Remembers with their features the frames in which the camera was not followed by points, some
// before and behind them, and the newest ones, to look there again once the map is complete.
class PassedFrames {
 public:
  // The next frame, in order.
  void Add(const Frame& frame, bool is_tracked);
  // In order; what was forgotten leaves holes.
  std::vector<Frame> All() const;
  void Clear();

 private:
  struct Passed {
    Frame frame;
    bool is_tracked = false;
  };
  std::deque<Passed> kept_, recent_;
  std::optional<int> last_lost_;  // of those kept
};

}  // namespace oaslam
