#include "oaslam/tracking/keyframe_units.h"

namespace oaslam {

std::map<KeyframeId, double> KeyframeUnits::ChangesIn(const Map& map) {
  std::map<KeyframeId, double> changes;
  if (knows_map_ && map.loops_closed == loops_closed_) return changes;
  const auto follow = [&](KeyframeId id, double unit) {
    double& known = units_.try_emplace(id, 1.0).first->second;
    if (knows_map_ && known != unit) changes[id] = unit / known;
    known = unit;
  };
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) { follow(id, k.unit); });
  map.retired.ForEach([&](KeyframeId id, const RetiredKeyframe& r) { follow(id, r.unit); });
  loops_closed_ = map.loops_closed;
  knows_map_ = true;
  return changes;
}

}  // namespace oaslam
