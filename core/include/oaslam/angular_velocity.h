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

// What the images tell of a gyroscope. kUnknown: no more than what is true of any phone's;
// kCalibrated: bias and offset; kRefused: most images contradict the samples, so that axes, unit or
// clock may be wrong.
enum class GyroscopeState { kUnknown, kCalibrated, kRefused };

// The errors of a gyroscope and of its clock. A sample with the time stamp t + offset_s belongs to
// an image with the time stamp t. While the state is kUnknown, bias and offset are zero and the
// sigmas are those of what a phone may have.
struct GyroscopeCalibration {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // rad/s, to be subtracted
  double sigma_bias = 0;                           // rad/s, of each axis
  double offset_s = 0, sigma_offset_s = 0;
  double sigma = 0;  // rad, of each axis: what images and samples differ by from image to image
  GyroscopeState state = GyroscopeState::kUnknown;
};

}  // namespace oaslam
