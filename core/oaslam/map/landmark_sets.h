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

// Drops the landmarks of an object that are no longer in the map, with their votes.
inline void ForgetErasedLandmarks(const Map& map, Object& object) {
  size_t kept = 0;
  for (size_t i = 0; i < object.landmarks.size(); ++i) {
    if (!map.landmarks.Contains(object.landmarks[i])) continue;
    object.landmarks[kept] = object.landmarks[i];
    object.landmark_votes[kept++] = object.landmark_votes[i];
  }
  object.landmarks.resize(kept);
  object.landmark_votes.resize(kept);
}

}  // namespace oaslam
