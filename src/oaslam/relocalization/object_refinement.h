#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/object_scene.h"

namespace oaslam {

// What is known of a pose besides its objects.
struct PosePrior {
  Rigid3 cam_from_world;
  Eigen::Matrix<double, 6, 6> information;  // inverse covariance of (translation, rotation [rad])
                                            // of a small motion applied after it
};

// Refines a pose on the edges of the boxes it explains, each weighted by the detector's and its
// object's uncertainty, and evaluates it (docs/objects.md, "From ellipsoids to a pose"). `margin`
// and `accepted` are left to the caller, who knows the other poses.
ObjectPoseCandidate RefineObjectPose(const ObjectScene& scene, const Rigid3& start,
                                     const std::optional<PosePrior>& prior = std::nullopt);

}  // namespace oaslam
