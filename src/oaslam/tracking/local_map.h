#pragma once

#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The part of the map around a frame.
struct LocalMap {
  // First those that share landmarks with the frame, most shared first; then
  // covisible keyframes of these.
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;  // all landmarks of these keyframes, each once
};

LocalMap CollectLocalMap(const Map& map, std::span<const LandmarkId> matched, int max_keyframes);

}  // namespace oaslam
