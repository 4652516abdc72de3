#include "oaslam/estimation/motion_filter.h"

#include "oaslam/geometry/decompositions.h"

namespace oaslam {
namespace {

// Usual speeds of a camera in a hand, and by how much they change within a second: half the depth
// of what it looks at, and 1 rad, each second.
constexpr double kSpeed = 0.5, kTurnRate = 1;

PoseVector MotionBetween(const Rigid3& from, const Rigid3& to) {
  const Rigid3 motion = to * from.Inverse();
  const Eigen::AngleAxisd turn(motion.rotation);
  PoseVector step;
  step << motion.translation, turn.angle() * turn.axis();
  return step;
}

}  // namespace

MotionFilter::MotionFilter(const Rigid3& cam_from_world, const Matrix6& covariance, double depth)
    : cam_from_world_(cam_from_world), covariance_(covariance) {
  const double speed = kSpeed * depth;
  variance_per_second_ << Eigen::Vector3d::Constant(speed * speed),
      Eigen::Vector3d::Constant(kTurnRate * kTurnRate);
  velocity_covariance_ = variance_per_second_.asDiagonal();
}

void MotionFilter::Predict(double seconds) {
  cam_from_world_ = Moved(cam_from_world_, velocity_ * seconds);
  const Matrix6 noise = variance_per_second_.asDiagonal();
  covariance_ += seconds * (cross_ + cross_.transpose()) +
                 seconds * seconds * velocity_covariance_ + seconds * seconds * seconds / 3 * noise;
  cross_ += seconds * velocity_covariance_ + seconds * seconds / 2 * noise;
  velocity_covariance_ += seconds * noise;
}

void MotionFilter::Correct(const Rigid3& cam_from_world, const Matrix6& covariance) {
  const Matrix6 velocity_from_pose = cross_.transpose() * InverseOf<6>(covariance_);
  velocity_ += velocity_from_pose * MotionBetween(cam_from_world_, cam_from_world);
  velocity_covariance_ -=
      velocity_from_pose * (covariance_ - covariance) * velocity_from_pose.transpose();
  cross_ = (velocity_from_pose * covariance).transpose();
  cam_from_world_ = cam_from_world;
  covariance_ = covariance;
}

}  // namespace oaslam
