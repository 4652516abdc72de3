#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// A world point seen at a pixel of the ideal image.
struct PointObservation {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  double inverse_variance = 1;  // px^-2; 1 / scale(octave)^2
};

struct PoseReport {
  bool success = false;  // at least 6 inliers that determine the pose
  Rigid3 cam_from_world;
  std::vector<uint8_t> inlier;  // per observation
  int inliers = 0;
  double rmse_px = 0;  // of the inliers, in pixels of their own octave
  // Of (translation, rotation [rad]) of a small motion applied after cam_from_world, at the stated
  // variances.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

// chi^2 of two degrees of freedom at 95 %: a reprojection beyond is an outlier.
inline constexpr double kChi2TwoDof = 5.991;

// Pose from points by robust nonlinear least squares: the hot path of tracking. Rounds of
// Levenberg-Marquardt with Huber's kernel, each followed by a classification of all observations
// (an outlier gets another chance); the last without kernel on the inliers. An observation behind
// the camera is an outlier.
PoseReport RefinePose(const Camera& camera, const Rigid3& initial_cam_from_world,
                      std::span<const PointObservation> observations);

}  // namespace oaslam
