#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The landmarks that any of the keyframes sees, ascending, each once.
inline std::vector<LandmarkId> LandmarksSeenBy(const Map& map,
                                               std::span<const KeyframeId> keyframes) {
  std::vector<LandmarkId> ids;
  for (const KeyframeId id : keyframes)
    for (const LandmarkId landmark : map.keyframes.At(id).landmarks)
      if (landmark.IsValid()) ids.push_back(landmark);
  std::ranges::sort(ids);
  const auto repeats = std::ranges::unique(ids);
  ids.erase(repeats.begin(), repeats.end());
  return ids;
}

}  // namespace oaslam
