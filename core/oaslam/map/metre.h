#pragma once

#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The length of the map's unit in metres, whatever loops have scaled since: the root mean square of
// the lengths that a sensor tells of the motions between keyframes (KeyframeMotion::metres) over
// that of the same motions in the map. Only motions that are much longer than their error count;
// nothing where these are few.
std::optional<double> MetresPerUnitByMotions(const Map& map);

}  // namespace oaslam
