#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/map/relocalization.h"
#include "oaslam/relocalization/object_scene.h"

namespace oaslam {

// Prior knowledge of a pose from other sources than objects.
struct PosePrior {
  Rigid3 cam_from_world;
  // Inverse covariance of a small motion (translation, rotation [rad]) applied after the pose.
  Eigen::Matrix<double, 6, 6> information;
};

// Refines a pose with the edges of the boxes it explains, each weighted by the uncertainty of
// detector and object, and computes its score (docs/objects.md, "From ellipsoids to a pose").
// `margin`, confidence and evidence are set by the caller, who knows the other poses.
Relocalization RefineObjectPose(const ObjectScene& scene, const PoseHypothesis& start,
                                const std::optional<PosePrior>& prior = std::nullopt);

}  // namespace oaslam
