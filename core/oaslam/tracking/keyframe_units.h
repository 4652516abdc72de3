#pragma once

#include <map>

#include "oaslam/map/map.h"

namespace oaslam {

// How loops have changed the lengths about keyframes (Keyframe::unit), as far as one who keeps
// poses relative to keyframes has followed.
class KeyframeUnits {
 public:
  // By what the lengths relative to each keyframe are to be multiplied; empty where no loop was
  // closed since the last call.
  std::map<KeyframeId, double> ChangesIn(const Map& map);
  // The next map is another one, whose lengths are followed already.
  void BeginAnew() { knows_map_ = false; }

 private:
  bool knows_map_ = true;  // the empty one
  int loops_closed_ = 0;
  std::map<KeyframeId, double> units_;
};

}  // namespace oaslam
