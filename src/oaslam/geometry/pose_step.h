#pragma once

#include <Eigen/Geometry>

#include "oaslam/rigid3.h"

namespace oaslam {

// Parameters of a pose cam_from_world: translation, then rotation vector [rad], both in the camera
// frame; they act from the left.
using PoseVector = Eigen::Matrix<double, 6, 1>;

// The rotation by |w| radians about w.
inline Eigen::Quaterniond RotationOf(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle))
                   : Eigen::Quaterniond::Identity();
}

// exp(w) * pose + t: its derivative by the step, of a point x in the camera frame, is
// [I | -[x]x] (Barfoot 2017, 7.3).
inline Rigid3 Moved(const Rigid3& cam_from_world, const PoseVector& step) {
  return Rigid3(RotationOf(step.tail<3>()), step.head<3>()) * cam_from_world;
}

// The step of a small motion.
inline PoseVector StepOf(const Rigid3& motion) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(motion.rotation));
  PoseVector step;
  step << motion.translation, turn.angle() * turn.axis();
  return step;
}

}  // namespace oaslam
