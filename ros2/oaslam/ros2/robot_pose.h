#pragma once

#include <optional>

#include "oaslam/exports/result_messages.h"
#include "oaslam/ids.h"

namespace oaslam {

// The pose of a frame of the robot in `map`, with its covariance.
struct RobotPose {
  Rigid3 map_from_frame{};
  RosCovariance covariance = RosCovariance::Zero();
};

// The pose of a frame that is fixed to the camera. What the camera's rotation leaves uncertain
// moves the frame as far as it is away.
RobotPose PoseOfFrame(const Rigid3& map_from_cam, const PoseCovariance& covariance,
                      const Rigid3& frame_from_cam);

// What the localizer adds above the odometry of the robot: map_from_odom.
inline Rigid3 MapFromOdom(const Rigid3& map_from_base, const Rigid3& odom_from_base) {
  return map_from_base * odom_from_base.Inverse();
}

// Whether the frame of the images has about the axes of the robot's base, x forward and z up, as a
// camera's own frame has; images are in its optical frame, z forward. Of a robot, a camera with
// these axes would look straight up.
bool HasAxesOfBase(const Rigid3& base_from_cam);

// The velocity between two poses, `seconds` apart, in the axes of the frame that moves; its
// covariance is that of two poses whose errors are independent, which those of neighbours are not:
// a bound.
RosTwist TwistBetween(const RobotPose& before, const RobotPose& now, double seconds);

}  // namespace oaslam
