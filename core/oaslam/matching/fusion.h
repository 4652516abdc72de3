#pragma once

#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// A landmark that a key point of a keyframe shows but is not associated with yet.
struct FusionCandidate {
  LandmarkId landmark;
  uint32_t keypoint = 0;
  bool operator==(const FusionCandidate&) const = default;
};

// Projects landmarks into a keyframe and finds key points that show them: within `radius_px` (at
// level 0), with a reprojection error below the 95 % bound and a close descriptor.
std::vector<FusionCandidate> FindFusionCandidates(const Map& map, KeyframeId keyframe,
                                                  std::span<const LandmarkId> landmarks,
                                                  double radius_px);

// Adds the observations; where a key point already has another landmark, the two are merged.
void ApplyFusion(std::span<const FusionCandidate> candidates, KeyframeId keyframe, Map& map);

}  // namespace oaslam
