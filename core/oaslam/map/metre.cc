#include "oaslam/map/metre.h"

#include <cmath>

namespace oaslam {

std::optional<double> MetresPerUnitByMotions(const Map& map) {
  constexpr int kLeastMotions = 10;
  constexpr double kLeastSigmas = 5;  // of the length of a motion
  double metres_squared = 0, units_squared = 0;
  int count = 0;
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    if (!keyframe.motion || !keyframe.motion->IsMetric()) return;
    const auto from = map.ResolvePose(keyframe.motion->from);
    if (!from || keyframe.motion->cam_from_cam.translation.norm() <
                     kLeastSigmas * keyframe.motion->sigma_position)
      return;
    ++count;
    const double weight = 1 / std::pow(keyframe.motion->relative_sigma, 2);
    metres_squared += weight * std::pow(keyframe.motion->metres, 2);
    units_squared +=
        weight * (keyframe.cam_from_world.OriginInSource() - from->OriginInSource()).squaredNorm();
  });
  if (count < kLeastMotions || !(units_squared > 0)) return std::nullopt;
  return std::sqrt(metres_squared / units_squared);
}

std::optional<double> SigmaOfMetre(const Map& map) {
  constexpr double kByUser = 0.02;  // of a length that a hand measured
  if (!map.is_metric) return std::nullopt;
  if (!map.unit_evidence) return kByUser;
  if (map.unit_evidence->source == UnitSource::kObjects) return std::nullopt;
  return map.unit_evidence->relative_sigma;
}

}  // namespace oaslam
