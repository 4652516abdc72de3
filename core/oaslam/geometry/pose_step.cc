#include "oaslam/geometry/pose_step.h"

namespace oaslam {

Eigen::Quaterniond RotationOf(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle))
                   : Eigen::Quaterniond::Identity();
}

Rigid3 Moved(const Rigid3& cam_from_world, const PoseVector& step) {
  return Rigid3(RotationOf(step.tail<3>()), step.head<3>()) * cam_from_world;
}

PoseVector StepOf(const Rigid3& motion) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(motion.rotation));
  PoseVector step;
  step << motion.translation, turn.angle() * turn.axis();
  return step;
}

}  // namespace oaslam
