#pragma once

#include "oaslam/map/map.h"

namespace oaslam {

// The map without what breaks its invariants (Map::CheckInvariants): observations that only one
// side knows, landmarks with fewer than two, keyframes and objects without a place, and what hangs
// on them. A consistent map comes back as it is. For the last resort: better a map with holes than
// none.
Map Repaired(const Map& map);

// Whether a pose is one at all.
bool IsFinite(const Rigid3& pose);

}  // namespace oaslam
