#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
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

// The prior of a pose: what is known before points are seen.
struct ExpectedPose {
  Rigid3 cam_from_world;
  // Standard deviation in the unit of the world; that of sigma_rotation is in rad.
  double sigma_position = 1;
  double sigma_rotation = 1;

  PoseCovariance Covariance() const;
};

struct PoseReport {
  bool success = false;  // at least 6 inliers that determine the pose; with a prior: always
  Rigid3 cam_from_world;
  std::vector<uint8_t> inlier;  // by observation
  int inliers = 0;
  // Covariance of a small motion (translation, rotation [rad]) applied after cam_from_world, given
  // the stated variances.
  PoseCovariance covariance = PoseCovariance::Zero();
};

// The 95 % quantiles of chi^2, by degrees of freedom: a larger squared error, in units of its
// variance, is that of an outlier. One: a distance from a line; two: a reprojection error.
inline constexpr double kChi2OneDof = 3.841, kChi2TwoDof = 5.991;

// Refines a pose from points by robust nonlinear least squares. It is called for each frame and
// must be fast. Rounds of Levenberg-Marquardt with Huber's kernel alternate with a new
// classification of all observations into inliers and outliers; the last round uses the inliers
// without kernel. An observation behind the camera is an outlier. Few points are enough where
// there is a `prior`.
PoseReport RefinePose(const Camera& camera, const Rigid3& initial_cam_from_world,
                      std::span<const PointObservation> observations,
                      const std::optional<ExpectedPose>& prior = std::nullopt);

}  // namespace oaslam
