#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <optional>

#include "oaslam/geometry/pose_step.h"
#include "oaslam/rigid3.h"

namespace oaslam {

struct MotionMeasurement {
  int from = 0, to = 0;  // poses
  Rigid3 to_from_from;
  double sigma_position = 1, sigma_rotation = 1;
  bool is_sure = false;  // its loss is not robust

  // Of LossOf; 0: not robust.
  double huber_chi2() const;
};

// The squared error from which on the loss of a motion is linear: the 95 % quantile of chi^2 of six
// degrees of freedom. The loss is robust since odometry can be in a wrong minimum,
// unless an IMU or a depth camera holds it.
inline constexpr double kChi2SixDof = 12.59;

inline double MotionMeasurement::huber_chi2() const { return is_sure ? 0 : kChi2SixDof; }

// The difference between the poses' motion and the measured one, in sigmas.
PoseVector MotionError(const MotionMeasurement& measured, const Rigid3& from, const Rigid3& to);

// The derivatives of MotionError by steps of the poses (geometry/pose_step.h). They assume a small
// error, and so depend on the measurement only.
struct MotionDerivatives {
  Eigen::Matrix<double, 6, 6> by_from, by_to;
};
MotionDerivatives DerivativesOf(const MotionMeasurement& measured);

// MotionError as a cost of Ceres, with parameter blocks of PoseManifold.
class MotionCost final : public ceres::CostFunction {
 public:
  // A pose that is given is fixed, and has no parameter block.
  MotionCost(const MotionMeasurement& measured, const std::optional<Rigid3>& from,
             const std::optional<Rigid3>& to);
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  MotionMeasurement measured_;
  MotionDerivatives derivatives_;
  std::optional<Rigid3> from_, to_;
};

}  // namespace oaslam
