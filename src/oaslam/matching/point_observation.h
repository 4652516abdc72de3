#pragma once

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/map.h"

namespace oaslam {

// A match of a key point and a landmark as an observation for pose estimation.
inline PointObservation ObservationOf(const Features& features, int keypoint,
                                      const Landmark& landmark) {
  const Keypoint& k = features.keypoints[keypoint];
  const double scale = features.pyramid.scale[k.octave];
  return {landmark.position, k.px.cast<double>(), 1 / (scale * scale)};
}

}  // namespace oaslam
