#pragma once

#include <Eigen/Core>
#include <optional>
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

// Where the camera should be, for want of better evidence, as by a motion model.
struct PositionPrior {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world
  double sigma = 1;                                    // map units
};

// Refines a pose on landmarks, as RefinePose does, and on matches with an earlier image whose pose is known: the squared Sampson
// distance of each to the epipolar geometry of the two poses (Hartley & Zisserman, 11.9) counts beside the reprojection errors, with
// Cauchy's kernel. Where the landmarks in view are few, or all in one corner, the matches hold the rotation; a prior
// then stands in for what they do not say of the position. May do without landmarks where there is a prior.
PoseReport RefinePoseByMatches(const Camera& camera, const Rigid3& initial_cam_from_world, std::span<const PointObservation> landmarks,
                               const Rigid3& before_from_world, std::span<const EpipolarMatch> matches,
                               const std::optional<PositionPrior>& prior = {});

// How many of the matches agree with the epipolar geometry of two poses, at 95 %.
int CountAgreeing(const Camera& camera, const Rigid3& cam_from_before, std::span<const EpipolarMatch> matches);

}  // namespace oaslam
