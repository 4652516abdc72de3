#pragma once

#include <Eigen/Core>
#include <span>

#include "oaslam/camera.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// One point of unknown depth in an image before and in this one.
struct EpipolarMatch {
  Eigen::Vector3d ray_before = Eigen::Vector3d::Zero(), ray = Eigen::Vector3d::Zero();  // z = 1
  double sigma_px = 1;
};

// Refines a pose on landmarks, as RefinePose does, and on matches with an earlier image whose pose
// is known: the squared Sampson distance of each to the epipolar geometry of the two poses (Hartley
// & Zisserman, 11.9) counts beside the reprojection errors, with Cauchy's kernel. Where the
// landmarks in view are few, or all in one corner, the matches hold the rotation.
PoseReport RefinePoseByMatches(const Camera& camera, const Rigid3& initial_cam_from_world,
                               std::span<const PointObservation> landmarks,
                               const Rigid3& before_from_world,
                               std::span<const EpipolarMatch> matches);

}  // namespace oaslam
