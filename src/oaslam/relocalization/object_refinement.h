#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/object_scene.h"

namespace oaslam {

// Prior knowledge of a pose from other sources than objects.
struct PosePrior {
  Rigid3 cam_from_world;
  // Inverse covariance of a small motion (translation, rotation [rad]) applied after the pose.
  Eigen::Matrix<double, 6, 6> information;
};

// Refines a pose on the edges of the boxes it explains, each weighted by the detector's and its
// object's uncertainty, and evaluates it (docs/objects.md, "From ellipsoids to a pose"). `margin`
// and `accepted` are left to the caller, who knows the other poses.
ObjectPoseCandidate RefineObjectPose(const ObjectScene& scene, const Rigid3& start,
                                     const std::optional<PosePrior>& prior = std::nullopt);

}  // namespace oaslam
