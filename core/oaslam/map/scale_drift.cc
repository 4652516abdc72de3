#include "oaslam/map/scale_drift.h"

#include <cmath>

namespace oaslam {

std::optional<double> ScaleVarianceByOdometry(const Keyframe& one, const Keyframe& other,
                                              int shared) {
  constexpr double kSoon = 5;  // seconds; a guess
  const Keyframe& later = one.timestamp < other.timestamp ? other : one;
  if (!one.scale_drift || !other.scale_drift || one.scale_drift->run != other.scale_drift->run ||
      std::abs(one.timestamp - other.timestamp) > kSoon || (shared == 0 && !later.motion))
    return std::nullopt;
  return std::abs(one.scale_drift->variance - other.scale_drift->variance);
}

void ForgetScaleDrift(Map& map) {
  for (const KeyframeId id : map.keyframes.Ids())
    if (map.keyframes.At(id).scale_drift) map.keyframes.MutableAt(id).scale_drift.reset();
}

}  // namespace oaslam
