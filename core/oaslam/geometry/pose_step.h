#pragma once

#include <Eigen/Geometry>

#include "oaslam/rigid3.h"

namespace oaslam {

// Parameters of a pose cam_from_world: translation, then rotation vector [rad], both in the camera
// frame; they act from the left.
using PoseVector = Eigen::Matrix<double, 6, 1>;

// The rotation by |w| radians about w.
Eigen::Quaterniond RotationOf(const Eigen::Vector3d& w);

// exp(w) * pose + t for the step (t, w). The derivative of a point p in the camera frame by the
// step is [I | -Skew(p)] (Barfoot 2017, 7.3).
Rigid3 Moved(const Rigid3& cam_from_world, const PoseVector& step);
// The step that moves the identity to `motion`.
PoseVector StepOf(const Rigid3& motion);

// The derivative by the step of a function of a point p in the camera frame, whose derivative by p
// is `by_p`.
inline Eigen::Matrix<double, 2, 6> DerivativeByPose(const Eigen::Matrix<double, 2, 3>& by_p,
                                                    const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 2, 6> by_pose;
  by_pose.leftCols<3>() = by_p;
  by_pose.col(3) = p.y() * by_p.col(2) - p.z() * by_p.col(1);
  by_pose.col(4) = p.z() * by_p.col(0) - p.x() * by_p.col(2);
  by_pose.col(5) = p.x() * by_p.col(1) - p.y() * by_p.col(0);
  return by_pose;
}

}  // namespace oaslam
