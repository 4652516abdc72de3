#pragma once

#include <Eigen/Core>

namespace oaslam {

// A sample of a gyroscope.
struct AngularVelocity {
  double timestamp = 0;  // seconds
  // rad/s, about the axes of the camera (x right, y down, z forward): the camera turns
  // counterclockwise for who looks against the vector.
  Eigen::Vector3d in_cam = Eigen::Vector3d::Zero();
};

}  // namespace oaslam
