#pragma once

#include <cstdint>

#include "oaslam/map/map.h"

namespace oaslam {

// For each kind, the first id of those that no piece of map uses: it and all larger ids are free.
struct NextIds {
  uint32_t keyframe = 0, landmark = 0, object = 0;
};

// The id of an object behind those that are, or were, in the map.
uint32_t NextObjectOf(const Map& map);
// The ids behind those that are, or were, in the map.
NextIds NextIdsOf(const Map& map);

// The ids behind those of both.
NextIds Behind(const NextIds& a, const NextIds& b);

}  // namespace oaslam
