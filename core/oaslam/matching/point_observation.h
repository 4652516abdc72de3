#pragma once

#include <vector>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/map.h"

namespace oaslam {

// A match of a key point and a point of the world as an observation for pose estimation.
inline PointObservation ObservationOf(const Features& features, int keypoint,
                                      const Eigen::Vector3d& position) {
  const Keypoint& k = features.keypoints[keypoint];
  const double scale = features.pyramid.scale[k.octave];
  return {position, k.px.cast<double>(), 1 / (scale * scale)};
}
inline PointObservation ObservationOf(const Features& features, int keypoint,
                                      const Landmark& landmark) {
  return ObservationOf(features, keypoint, landmark.position);
}

struct MatchedPoints {
  std::vector<PointObservation> observations;
  std::vector<int> keypoints;  // parallel
};

// The key points that have a match; `matches`: the landmark of each key point, invalid where there
// is none.
inline MatchedPoints ObserveMatches(const Features& features, const Map& map,
                                    const std::vector<LandmarkId>& matches) {
  MatchedPoints matched;
  for (int k = 0; k < static_cast<int>(matches.size()); ++k) {
    if (!matches[k].IsValid()) continue;
    matched.observations.push_back(ObservationOf(features, k, map.landmarks.At(matches[k])));
    matched.keypoints.push_back(k);
  }
  return matched;
}

}  // namespace oaslam
