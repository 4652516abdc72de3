#include "oaslam/ros2/robot_pose.h"

#include <gtest/gtest.h>

#include <numbers>

namespace oaslam {
namespace {

constexpr double kHalf = std::numbers::pi / 2;

Rigid3::Rotation Turn(double angle, const Eigen::Vector3d& axis) {
  return Rigid3::Rotation(Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)));
}

// A camera that looks forward, 0.1 m before and 0.5 m above the base.
const Rigid3 kBaseFromCam(Rigid3::Rotation(0.5, -0.5, 0.5, -0.5), {0.1, 0, 0.5});

TEST(RobotPose, IsThatOfTheBaseAndNotTurned) {
  // The camera of a robot that stands at (2, 3, 0) and looks to the left of `map`.
  const Rigid3 map_from_base(Turn(kHalf, Eigen::Vector3d::UnitZ()), {2, 3, 0});
  const RobotPose pose =
      PoseOfFrame(map_from_base * kBaseFromCam, PoseCovariance::Zero(), kBaseFromCam);
  EXPECT_LT((pose.map_from_frame.Matrix() - map_from_base.Matrix()).norm(), 1e-12);
  EXPECT_LT(
      (pose.map_from_frame.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(),
      1e-12);
}

TEST(RobotPose, AFrameWithTheAxesOfTheBaseIsFound) {
  EXPECT_FALSE(HasAxesOfBase(kBaseFromCam));
  EXPECT_TRUE(HasAxesOfBase({Turn(0.1, Eigen::Vector3d::UnitY()), {0.1, 0, 0.5}}));
}

TEST(RobotPose, AnUncertainTurnMovesTheBase) {
  PoseCovariance covariance = PoseCovariance::Zero();
  covariance(4, 4) = 0.04;  // about the camera's y, which is down
  const RobotPose pose = PoseOfFrame(kBaseFromCam, covariance, kBaseFromCam);
  // The base is 0.1 m behind the camera: it moves to the side.
  EXPECT_NEAR(pose.covariance(1, 1), 0.1 * 0.1 * 0.04, 1e-12);
  EXPECT_NEAR(pose.covariance(0, 0), 0, 1e-12);
  EXPECT_NEAR(pose.covariance(5, 5), 0.04, 1e-12);
  // About z to the left, what is behind goes to the right.
  EXPECT_NEAR(pose.covariance(1, 5), -0.1 * 0.04, 1e-12);
}

TEST(RobotPose, OdomComesBetweenMapAndBase) {
  const Rigid3 odom_from_base(Turn(0.3, Eigen::Vector3d::UnitZ()), {5, 1, 0});
  const Rigid3 map_from_base(Turn(-0.4, Eigen::Vector3d::UnitZ()), {2, 3, 0.1});
  const Rigid3 chain = MapFromOdom(map_from_base, odom_from_base) * odom_from_base;
  EXPECT_LT((chain.Matrix() - map_from_base.Matrix()).norm(), 1e-12);
}

TEST(RobotPose, VelocityIsInTheAxesOfTheRobot) {
  // It looks along y of the map, and drives there at 0.5 m/s; then it turns on the spot.
  RobotPose before{Rigid3(Turn(kHalf, Eigen::Vector3d::UnitZ()), {2, 3, 0})}, now = before;
  before.covariance(0, 0) = now.covariance(0, 0) = 0.01;
  now.map_from_frame.translation.y() += 0.05;
  const RosTwist driving = TwistBetween(before, now, 0.1);
  EXPECT_LT((driving.linear - Eigen::Vector3d(0.5, 0, 0)).norm(), 1e-12);
  EXPECT_LT(driving.angular.norm(), 1e-12);
  EXPECT_NEAR(driving.covariance(1, 1), 2, 1e-9);  // x of the map is y of the robot
  RobotPose turned = now;
  turned.map_from_frame.rotation =
      turned.map_from_frame.rotation * Turn(-0.02, Eigen::Vector3d::UnitZ());
  const RosTwist turning = TwistBetween(now, turned, 0.1);
  EXPECT_LT((turning.angular - Eigen::Vector3d(0, 0, -0.2)).norm(), 1e-9);
  EXPECT_LT(turning.linear.norm(), 1e-12);
}

}  // namespace
}  // namespace oaslam
