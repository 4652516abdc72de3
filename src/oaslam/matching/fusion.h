#pragma once

#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// A landmark seen at a key point of a keyframe that does not know it yet.
struct FusionCandidate {
  LandmarkId landmark;
  uint32_t keypoint = 0;
  bool operator==(const FusionCandidate&) const = default;
};

// Projects landmarks into a keyframe and finds those that it shows: within `radius_px` (at level
// 0), reprojection error below the 95 % bound, descriptor close.
std::vector<FusionCandidate> FindFusionCandidates(const Map& map, KeyframeId keyframe,
                                                  std::span<const LandmarkId> landmarks,
                                                  double radius_px);

// Adds the observations; where the key point already holds another landmark the two become one.
void ApplyFusion(std::span<const FusionCandidate> candidates, KeyframeId keyframe, Map& map);

}  // namespace oaslam
