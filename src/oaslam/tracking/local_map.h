#pragma once

#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The part of the map around a frame.
struct LocalMap {
  std::vector<KeyframeId>
      keyframes;  // those sharing most landmarks with the frame first, then neighbours of these
  std::vector<LandmarkId> landmarks;  // seen by them, each once, in the order of the keyframes
};

LocalMap CollectLocalMap(const Map& map, std::span<const LandmarkId> matched, int max_keyframes);

}  // namespace oaslam
