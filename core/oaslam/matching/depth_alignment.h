#pragma once

#include <optional>

#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What a landmark is off by along the ray, a share of its depth; a guess.
inline constexpr double kLandmarkDepthSigma = 0.02;

struct AlignedPose {
  Rigid3 cam_from_world;
  PoseCovariance covariance;
};

// Moves a pose so that the landmarks in view, whether or not they are recognized, lie on the
// surfaces that the depth camera measured. Distances are those of points from planes (Chen and
// Medioni 1992), and the pose with its covariance is the prior, so that it decides where a wall
// alone leaves the pose open. The map must have a metre (SigmaOfMetre); nothing in another map,
// without depths, and where few landmarks are in view.
std::optional<AlignedPose> AlignToDepths(const Frame& frame, const Map& map,
                                         const Rigid3& cam_from_world,
                                         const PoseCovariance& covariance);

}  // namespace oaslam
