#pragma once

#include <Eigen/Core>

namespace oaslam {

// A sample of a gyroscope.
struct AngularVelocity {
  double timestamp = 0;  // seconds
  // rad/s, about the axes of the camera (x right, y down, z forward), by the right-hand rule: seen
  // from the tip of the vector, the camera turns counterclockwise.
  Eigen::Vector3d in_cam = Eigen::Vector3d::Zero();
};

// What the images have revealed about a gyroscope. kUnknown: little more than what holds for any
// phone's gyroscope; kCalibrated: its bias and its clock offset; kRefused: most images contradict
// the samples, whose axes, unit or clock may be wrong.
enum class GyroscopeState { kUnknown, kCalibrated, kRefused };

// The errors of a gyroscope and of its clock. A sample with the time stamp t + offset_s belongs to
// an image with the time stamp t. Before the first comparison with images, bias and offset are zero
// and their sigmas are those of a typical phone; the state stays kUnknown until the images have
// halved both sigmas.
struct GyroscopeCalibration {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // rad/s, to be subtracted
  double sigma_bias = 0;                           // rad/s, of each axis
  double offset_s = 0, sigma_offset_s = 0;
  // rad, of each axis: standard deviation between the rotation by samples and that by images, for
  // one pair of images.
  double sigma = 0;
  GyroscopeState state = GyroscopeState::kUnknown;
};

}  // namespace oaslam
