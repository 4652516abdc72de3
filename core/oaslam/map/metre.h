#pragma once

#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The length of the map's unit in metres, also after loops have scaled the map: the root mean
// square length of the motions between keyframes by a sensor (KeyframeMotion::metres), divided by
// that of the same motions in the map. Motions shorter than 5 of their sigmas are ignored. Nothing
// where fewer than 10 remain.
std::optional<double> MetresPerUnitByMotions(const Map& map);

// The relative standard deviation of the metre of a map in metres. Nothing where the map is not in
// metres, or has its metre only from the usual sizes of objects.
std::optional<double> SigmaOfMetre(const Map& map);

}  // namespace oaslam
