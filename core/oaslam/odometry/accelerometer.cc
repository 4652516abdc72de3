#include "oaslam/odometry/accelerometer.h"

#include <algorithm>

#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

constexpr double kMostGap = 0.1;    // s, as of the gyroscope
constexpr double kKeptSeconds = 5;  // s of samples

ImuSample Between(const ImuSample& a, const ImuSample& b, double time_s) {
  const double share = (time_s - a.timestamp) / (b.timestamp - a.timestamp);
  return {time_s, a.angular_velocity + share * (b.angular_velocity - a.angular_velocity),
          a.acceleration + share * (b.acceleration - a.acceleration)};
}

}  // namespace

Push Composed(const Push& first, const Eigen::Matrix3d& first_from_second, const Push& second) {
  const auto along = [&](const auto& velocity, const auto& place, const auto& then) {
    return (place + second.seconds * velocity + first_from_second * then).eval();
  };
  return {first.seconds + second.seconds, first.velocity + first_from_second * second.velocity,
          along(first.velocity, first.place, second.place),
          first.velocity_by_bias + first_from_second * second.velocity_by_bias,
          along(first.velocity_by_bias, first.place_by_bias, second.place_by_bias)};
}

void Accelerometer::Add(std::span<const ImuSample> samples) {
  for (const ImuSample& sample : samples)
    if (samples_.empty() || sample.timestamp > samples_.back().timestamp)
      samples_.push_back(sample);
  while (samples_.size() > 1 &&
         samples_.front().timestamp < samples_.back().timestamp - kKeptSeconds)
    samples_.pop_front();
}

std::optional<Push> Accelerometer::Between(double first_s, double second_s,
                                           const GyroscopeCalibration& gyroscope) const {
  const double begin = first_s + gyroscope.offset_s, end = second_s + gyroscope.offset_s;
  auto after = std::ranges::upper_bound(samples_, begin, {}, &ImuSample::timestamp);
  if (after == samples_.begin() || after == samples_.end()) return std::nullopt;
  Push push;
  Eigen::Quaterniond first_from_now = Eigen::Quaterniond::Identity();
  ImuSample last = oaslam::Between(*(after - 1), *after, begin);
  double gap = after->timestamp - (after - 1)->timestamp;
  while (last.timestamp < end) {
    if (gap > kMostGap) return std::nullopt;
    ImuSample next;
    if (after == samples_.end()) {  // a little is missing at the end: the values stay
      if (end - last.timestamp > 0.02) return std::nullopt;
      next = last;
      next.timestamp = end;
    } else if (after->timestamp > end) {
      next = oaslam::Between(*(after - 1), *after, end);
    } else {
      next = *after;
    }
    const double seconds = next.timestamp - last.timestamp;
    const Eigen::Vector3d rate =
        0.5 * (last.angular_velocity + next.angular_velocity) - gyroscope.bias;
    const Eigen::Quaterniond half = RotationOf(0.5 * seconds * rate);
    const Eigen::Matrix3d middle = (first_from_now * half).toRotationMatrix();
    const Eigen::Vector3d acceleration = middle * (0.5 * (last.acceleration + next.acceleration));
    push.place += seconds * push.velocity + 0.5 * seconds * seconds * acceleration;
    push.place_by_bias += seconds * push.velocity_by_bias + 0.5 * seconds * seconds * middle;
    push.velocity += seconds * acceleration;
    push.velocity_by_bias += seconds * middle;
    push.seconds += seconds;
    first_from_now = (first_from_now * half * half).normalized();
    last = next;
    if (after != samples_.end() && next.timestamp == after->timestamp) {
      gap = after + 1 == samples_.end() ? 0 : (after + 1)->timestamp - after->timestamp;
      ++after;
    }
  }
  return push;
}

}  // namespace oaslam
