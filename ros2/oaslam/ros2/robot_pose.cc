#include "oaslam/ros2/robot_pose.h"

#include <numbers>

namespace oaslam {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

RobotPose PoseOfFrame(const Rigid3& map_from_cam, const PoseCovariance& covariance,
                      const Rigid3& frame_from_cam) {
  RobotPose pose{map_from_cam * frame_from_cam.Inverse()};
  const Eigen::Vector3d arm = pose.map_from_frame.translation - map_from_cam.translation;
  Matrix6 moved = Matrix6::Identity();
  moved.topRightCorner<3, 3>() = -Cross(arm);
  pose.covariance = moved * InAxesOf(map_from_cam, covariance) * moved.transpose();
  return pose;
}

bool HasAxesOfBase(const Rigid3& base_from_cam) {
  constexpr double kNear = 20 * std::numbers::pi / 180;  // rad
  return base_from_cam.rotation.angularDistance(Rigid3::Rotation::Identity()) < kNear;
}

RosTwist TwistBetween(const RobotPose& before, const RobotPose& now, double seconds) {
  const Rigid3 moved = before.map_from_frame.Inverse() * now.map_from_frame;
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(moved.rotation));
  const Rigid3::Rotation now_from_map = now.map_from_frame.rotation.conjugate();
  RosTwist twist;
  twist.linear =
      now_from_map * (now.map_from_frame.translation - before.map_from_frame.translation) / seconds;
  twist.angular = turn.angle() * turn.axis() / seconds;
  Matrix6 turned = Matrix6::Zero();
  turned.topLeftCorner<3, 3>() = turned.bottomRightCorner<3, 3>() = now_from_map.toRotationMatrix();
  twist.covariance =
      turned * (before.covariance + now.covariance) * turned.transpose() / (seconds * seconds);
  return twist;
}

}  // namespace oaslam
