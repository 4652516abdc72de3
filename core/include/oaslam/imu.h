#pragma once

#include <Eigen/Core>
#include <string>

#include "oaslam/angular_velocity.h"

namespace oaslam {

// A sample of an inertial measurement unit, along the IMU's own axes (Slam::SetImu tells the pose
// of the IMU relative to the camera):
//
//   slam.SetImu(cam_from_imu);  // Kalibr's T_cam_imu
//   const std::vector<ImuSample> samples = {{0.005, {0, 0.1, 0}, {0, -9.8, 0.3}}};
//   slam.Process({.image = image, .timestamp = timestamp, .imu = samples});
//   if (!slam.Imu().problem.empty()) std::cerr << slam.Imu().problem << "\n";
struct ImuSample {
  double timestamp = 0;                                        // seconds
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s, as AngularVelocity
  // Specific force, m/s^2: an IMU at rest measures 9.81 away from the ground, one in free fall 0.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

// What the images have revealed about an accelerometer. kUnknown: less than is needed for the
// length of a metre; kCalibrated: the metre, and with it the bias and gravity; kRefused: the
// accelerations contradict the images.
enum class AccelerometerState { kUnknown, kCalibrated, kRefused };

// The errors of an IMU, and what follows from it.
struct ImuCalibration {
  GyroscopeCalibration gyroscope;
  AccelerometerState accelerometer = AccelerometerState::kUnknown;
  // m/s^2, to be subtracted, along the camera's axes; zero while it is not known.
  Eigen::Vector3d acceleration_bias = Eigen::Vector3d::Zero();
  double sigma_acceleration_bias = 0;  // m/s^2, of each axis; 0 while the bias is not known
  // The standard deviation of the metre that follows from the IMU, divided by the metre; 0 while
  // it is not known.
  double sigma_metre = 0;
  // What is wrong with the IMU, such as its axes, and why the accelerometer is not used; empty:
  // nothing.
  std::string problem{};
};

}  // namespace oaslam
