#pragma once

#include <Eigen/Core>
#include <span>

#include "oaslam/camera.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// A point of unknown depth, matched between an earlier image and this one.
struct EpipolarMatch {
  Eigen::Vector3d ray_before = Eigen::Vector3d::Zero(), ray = Eigen::Vector3d::Zero();  // z = 1
  double sigma_px = 1;
};

// Refines a pose with landmarks, as RefinePose does, and with matches to an earlier image whose
// pose is known: each match adds its squared Sampson distance to the epipolar geometry (Hartley &
// Zisserman, 11.9), with Cauchy's kernel. Where the landmarks in view are few or all in one corner,
// the matches determine the rotation.
PoseReport RefinePoseByMatches(const Camera& camera, const Rigid3& initial_cam_from_world,
                               std::span<const PointObservation> landmarks,
                               const Rigid3& before_from_world,
                               std::span<const EpipolarMatch> matches);

}  // namespace oaslam
