#include "oaslam/matching/fusion.h"

#include <algorithm>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/matching/projection_search.h"

namespace oaslam {

std::vector<FusionCandidate> FindFusionCandidates(const Map& map, KeyframeId keyframe_id,
                                                  std::span<const LandmarkId> landmarks,
                                                  double radius_px) {
  const Keyframe& keyframe = map.keyframes.At(keyframe_id);
  const Features& features = *keyframe.features;
  std::vector<FusionCandidate> candidates;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.landmarks.Find(id);
    if (!landmark) continue;
    const auto by_keyframe =
        std::ranges::lower_bound(landmark->observations, keyframe_id, {}, &Observation::keyframe);
    if (by_keyframe != landmark->observations.end() && by_keyframe->keyframe == keyframe_id)
      continue;
    const auto projected = ProjectLandmark(id, *landmark, map.cameras[keyframe.camera],
                                           keyframe.cam_from_world, features);
    if (!projected) continue;
    int best = kTightHamming + 1, best_keypoint = -1;
    features.VisitNear(
        projected->px, radius_px * features.pyramid.scale[projected->level], [&](int k) {
          const Keypoint& keypoint = features.keypoints[k];
          if (keypoint.octave < projected->level - 1 || keypoint.octave > projected->level + 1)
            return;
          const double sigma = features.pyramid.scale[keypoint.octave];
          if ((keypoint.px.cast<double>() - projected->px).squaredNorm() >
              kChi2TwoDof * sigma * sigma)
            return;
          const int distance = HammingDistance(landmark->descriptor, features.descriptors[k]);
          if (distance < best) {
            best = distance;
            best_keypoint = k;
          }
        });
    if (best_keypoint >= 0) candidates.push_back({id, static_cast<uint32_t>(best_keypoint)});
  }
  return candidates;
}

void ApplyFusion(std::span<const FusionCandidate> candidates, KeyframeId keyframe_id, Map& map) {
  for (const FusionCandidate& c : candidates) {
    if (!map.landmarks.Contains(c.landmark)) continue;  // merged away by an earlier candidate
    const LandmarkId there = map.keyframes.At(keyframe_id).landmarks[c.keypoint];
    if (!there.IsValid()) {
      if (map.AddObservation(c.landmark, keyframe_id, c.keypoint)) map.UpdateLandmark(c.landmark);
    } else if (map.landmarks.At(there).observations.size() >
               map.landmarks.At(c.landmark).observations.size()) {
      map.MergeLandmarks(c.landmark, there);
    } else {
      map.MergeLandmarks(there, c.landmark);
    }
  }
}

}  // namespace oaslam
