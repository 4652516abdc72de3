#pragma once

#include <Eigen/Core>

#include "oaslam/geometry/pose_step.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// Predicts a camera's pose: a Kalman filter of pose and velocity, which assumes that the velocity
// stays as it is. The velocity is that of a motion applied after the pose, so that it is constant
// while a camera circles around what it looks at.
class MotionFilter {
 public:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  // The velocity is unknown at first. `covariance`: of a small motion (translation, rotation
  // [rad]) applied after the pose. `depth`: of what it looks at, map units; usual speeds are
  // relative to it.
  MotionFilter(const Rigid3& cam_from_world, const Matrix6& covariance, double depth);

  void Predict(double seconds);
  // Replaces the predicted pose by an estimate that started from it; `covariance`: of the estimate.
  void Correct(const Rigid3& cam_from_world, const Matrix6& covariance);

  const Rigid3& cam_from_world() const { return cam_from_world_; }
  const Matrix6& covariance() const { return covariance_; }

 private:
  Rigid3 cam_from_world_;
  PoseVector velocity_ = PoseVector::Zero();  // per second
  PoseVector variance_per_second_;            // by which the velocity changes
  Matrix6 covariance_, velocity_covariance_;
  Matrix6 cross_ = Matrix6::Zero();  // covariance of pose and velocity
};

}  // namespace oaslam
