#pragma once

#include <cstdint>

#include "oaslam/map/map.h"

namespace oaslam {

// For each kind, the first free id: no submap uses it or a larger one.
struct NextIds {
  uint32_t keyframe = 0, landmark = 0, object = 0;
};

// The first id of an object that was never in the map.
uint32_t NextObjectOf(const Map& map);
// The first ids that were never in the map.
NextIds NextIdsOf(const Map& map);

// The larger of both, for each kind.
NextIds Behind(const NextIds& a, const NextIds& b);

}  // namespace oaslam
