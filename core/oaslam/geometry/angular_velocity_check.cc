#include "oaslam/geometry/angular_velocity_check.h"

#include <fmt/format.h>

#include <cmath>

namespace oaslam {

std::string ProblemOf(const AngularVelocity& sample, const double* last) {
  // The range of the gyroscopes in phones is 35 rad/s; degrees are larger soon.
  constexpr double kMost = 100;
  if (!std::isfinite(sample.timestamp) || !sample.in_cam.allFinite())
    return "angular velocity: must be finite";
  const double speed = sample.in_cam.norm();
  if (speed > kMost)
    return fmt::format("angular velocity: {:.6g} rad/s, allowed: 0 to {:.0f}", speed, kMost);
  if (last && !(sample.timestamp > *last))
    return fmt::format("angular velocity: time stamp {:.6f} is not after the one before, {:.6f}",
                       sample.timestamp, *last);
  return "";
}

std::string ProblemOfAcceleration(const Eigen::Vector3d& acceleration) {
  constexpr double kMost = 1000;  // the range of the accelerometers of phones is 160
  const double length = acceleration.norm();
  if (length <= kMost) return "";
  return fmt::format("acceleration: {:.6g} m/s^2, allowed: 0 to {:.0f}", length, kMost);
}

}  // namespace oaslam
