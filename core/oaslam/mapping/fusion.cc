#include "oaslam/matching/fusion.h"

#include <algorithm>

#include "oaslam/map/landmark_sets.h"
#include "oaslam/mapping/local_mapping.h"

namespace oaslam {

void FuseLandmarks(KeyframeId id, Map& map) {
  constexpr double kRadiusPx = 3;       // the pose is adjusted already
  constexpr int kSecondNeighbours = 5;  // of each neighbour; bounds the time
  std::vector<KeyframeId> targets = map.CovisibleKeyframes(id, kFusedKeyframes);
  const size_t direct = targets.size();
  for (size_t i = 0; i < direct; ++i)
    for (const KeyframeId second : map.CovisibleKeyframes(targets[i], kSecondNeighbours))
      if (second != id && std::ranges::find(targets, second) == targets.end())
        targets.push_back(second);
  const auto landmarks_of = [&](KeyframeId keyframe) {
    return LandmarksSeenBy(map, std::span(&keyframe, 1));
  };
  for (const KeyframeId target : targets)
    ApplyFusion(FindFusionCandidates(map, target, landmarks_of(id), kRadiusPx), target, map);

  const std::vector<LandmarkId> theirs = LandmarksSeenBy(map, targets);
  ApplyFusion(FindFusionCandidates(map, id, theirs, kRadiusPx), id, map);
  for (const LandmarkId landmark : landmarks_of(id)) map.UpdateLandmark(landmark);
  map.UpdateCovisibility(id);
}

}  // namespace oaslam
