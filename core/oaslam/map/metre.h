#pragma once

#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The length of the map's unit in metres, also after loops have scaled the map: the root mean
// square length of the motions between keyframes by a sensor (KeyframeMotion::metres), divided by
// that of the same motions in the map. Motions shorter than 5 of their sigmas are ignored. Nothing
// where fewer than 10 remain.
std::optional<double> MetresPerUnitByMotions(const Map& map);

}  // namespace oaslam
