#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/odometry/window.h"

namespace oaslam {

// A point of known inverse depth, measured in a new image.
struct PosePoint {
  Eigen::Vector3d direction;      // its ray at the anchor, turned into the odometry's frame
  Eigen::Vector3d anchor_center;  // in the odometry's frame
  double inverse_depth = 1, variance = 1;
  Eigen::Vector2d ray;  // in the new image
  // Of the sighting, in squares of WindowOptions::sigma_px.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};

// The prior of a pose, in the frame and the unit of the odometry.
struct PoseFitPrior {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double sigma = 1;
  // The rotation cam_from_odom by a gyroscope, where there is one.
  std::optional<Turn> rotation{};
};

// The rotation that takes rays of one image to those of another, as if all points were far away;
// robust against those that are not. Begins at `start`.
Eigen::Matrix3d RotationBetween(std::span<const Eigen::Vector2d> first,
                                std::span<const Eigen::Vector2d> second, Eigen::Matrix3d start);

// `inflation` for RefinePose where the start is a prediction.
inline constexpr double kFarStart = 8;

// Estimates the pose of a new image from its points, whose depths may be wrong by their variances:
// Gauss-Newton, which begins with errors that are `inflation` times as large, so that it converges
// from a start that is far away.
Rigid3 RefinePose(std::span<const PosePoint> points, const WindowOptions& options,
                  const PoseFitPrior& prior, double inflation, const Rigid3& start);

// The distinct poses that RefinePose reaches from the predicted one (`by_prediction`, with the
// inflation kFarStart), from the predicted place with the rotation of the flow, and from the
// prediction with its place nearly held. In a narrow view rotation and translation look alike, and
// only the optimisation of the window tells which pose is right.
std::vector<Rigid3> PoseStarts(std::span<const PosePoint> points, const WindowOptions& options,
                               const PoseFitPrior& prior, const Rigid3& predicted,
                               const Rigid3& by_prediction, const Eigen::Matrix3d& rotation_of_flow,
                               double last_step);

}  // namespace oaslam
