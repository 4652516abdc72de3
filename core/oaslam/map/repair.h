#pragma once

#include "oaslam/map/map.h"

namespace oaslam {

// The map without the elements that violate its invariants (Map::CheckInvariants): observations
// that only one side knows, landmarks with fewer than two observations, keyframes whose features,
// camera or pose are not valid, objects whose ellipsoid is not finite; and retired keyframes,
// observations and anchors that refer to these. A consistent map is returned unchanged. This is a
// last resort: a map with gaps is better than none.
Map Repaired(const Map& map);

}  // namespace oaslam
