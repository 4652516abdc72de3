#include "oaslam/map/scale_drift.h"

#include <cmath>

namespace oaslam {

std::optional<double> ScaleVarianceByOdometry(const Keyframe& one, const Keyframe& other) {
  constexpr double kOneWay = 5;  // seconds; a guess
  if (!one.scale_drift || !other.scale_drift || one.scale_drift->run != other.scale_drift->run ||
      std::abs(one.timestamp - other.timestamp) > kOneWay)
    return std::nullopt;
  return std::abs(one.scale_drift->variance - other.scale_drift->variance);
}

}  // namespace oaslam
