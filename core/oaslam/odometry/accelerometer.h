#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <span>

#include "oaslam/imu.h"
#include "oaslam/odometry/gyroscope.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// What an accelerometer measured between two images, integrated along the axes that the camera had
// in the first one (preintegration: Lupton and Sukkarieh 2012, Forster et al. 2017). Gravity is in
// it, and so is the bias: that of b m/s^2 adds by_bias * b.
struct Push {
  double seconds = 0;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s: the integral of the acceleration
  Eigen::Vector3d place = Eigen::Vector3d::Zero();     // m: the integral of `velocity`
  Eigen::Matrix3d velocity_by_bias = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d place_by_bias = Eigen::Matrix3d::Zero();
};

// The push over two stretches of time. `first_from_second`: the camera's axes at their beginnings.
Push Composed(const Push& first, const Eigen::Matrix3d& first_from_second, const Push& second);

// The accelerometer of an IMU.
class Accelerometer {
 public:
  // Samples along the camera's axes, at times of the gyroscope's clock, ascending.
  void Add(std::span<const ImuSample> samples);
  // The push between the times of two images; nothing where samples are missing, and before the
  // first ones. The gyroscope's calibration is used.
  std::optional<Push> Between(double first_s, double second_s,
                              const GyroscopeCalibration& gyroscope) const;
  bool IsEmpty() const { return samples_.empty(); }

 private:
  std::deque<ImuSample> samples_;
};

}  // namespace oaslam
