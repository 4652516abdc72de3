#pragma once

#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The length of the map's unit in metres by the motions between its keyframes whose lengths a
// sensor tells (KeyframeMotion::metres), whatever loops have scaled since. Errors of these lengths
// and of the map's count alike. Nothing where there is no such motion.
std::optional<double> MetresPerUnitByMotions(const Map& map);

}  // namespace oaslam
