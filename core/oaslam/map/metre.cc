#include "oaslam/map/metre.h"

#include <cmath>

namespace oaslam {

std::optional<double> MetresPerUnitByMotions(const Map& map) {
  double metres_squared = 0, units_squared = 0;
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    if (!keyframe.motion || !keyframe.motion->IsMetric()) return;
    const auto from = map.ResolvePose(keyframe.motion->from);
    if (!from) return;
    const double weight = 1 / std::pow(keyframe.motion->relative_sigma, 2);
    metres_squared += weight * std::pow(keyframe.motion->metres, 2);
    units_squared +=
        weight * (keyframe.cam_from_world.OriginInSource() - from->OriginInSource()).squaredNorm();
  });
  if (!(metres_squared > 0 && units_squared > 0)) return std::nullopt;
  return std::sqrt(metres_squared / units_squared);
}

}  // namespace oaslam
