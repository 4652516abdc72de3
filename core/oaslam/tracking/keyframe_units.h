#pragma once

#include <map>

#include "oaslam/map/map.h"

namespace oaslam {

// Follows how loops change the unit of length around keyframes (Keyframe::unit), for an owner of
// poses that are relative to keyframes.
class KeyframeUnits {
 public:
  // The factors by which the owner must multiply its lengths relative to each keyframe; empty where
  // no loop was closed since the last call.
  std::map<KeyframeId, double> ChangesIn(const Map& map);
  // The next call of ChangesIn gets another map, whose units the lengths of the owner already have.
  void BeginAnew() { knows_map_ = false; }

 private:
  bool knows_map_ = true;  // at first the empty map
  int loops_closed_ = 0;
  std::map<KeyframeId, double> units_;
};

}  // namespace oaslam
