#include "oaslam/bundle/motion_cost.h"

#include "oaslam/bundle/reprojection_cost.h"
#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

PoseVector InverseSigmas(const MotionMeasurement& measured) {
  PoseVector inverse;
  inverse << Eigen::Vector3d::Constant(1 / measured.sigma_position),
      Eigen::Vector3d::Constant(1 / measured.sigma_rotation);
  return inverse;
}

}  // namespace

PoseVector MotionError(const MotionMeasurement& measured, const Rigid3& from, const Rigid3& to) {
  const Rigid3 off = to * from.Inverse() * measured.to_from_from.Inverse();
  return InverseSigmas(measured).cwiseProduct(StepOf(off));
}

MotionDerivatives DerivativesOf(const MotionMeasurement& measured) {
  const Eigen::Matrix3d r = measured.to_from_from.rotation.toRotationMatrix();
  const PoseVector inverse = InverseSigmas(measured);
  MotionDerivatives d;
  d.by_to = inverse.asDiagonal();
  // A step of `from`, seen from `to`: the adjoint of the motion (Barfoot 2017, 7.1.4).
  d.by_from.setZero();
  d.by_from.topLeftCorner<3, 3>() = -r;
  d.by_from.topRightCorner<3, 3>() = -Skew(measured.to_from_from.translation) * r;
  d.by_from.bottomRightCorner<3, 3>() = -r;
  d.by_from = (inverse.asDiagonal() * d.by_from).eval();
  return d;
}

MotionCost::MotionCost(const MotionMeasurement& measured, const std::optional<Rigid3>& from,
                       const std::optional<Rigid3>& to)
    : measured_(measured), derivatives_(DerivativesOf(measured)), from_(from), to_(to) {
  set_num_residuals(6);
  for (const auto& fixed : {from, to})
    if (!fixed) mutable_parameter_block_sizes()->push_back(7);
}

bool MotionCost::Evaluate(const double* const* parameters, double* residuals,
                          double** jacobians) const {
  const size_t to_block = from_ ? 0 : 1;
  const Rigid3 from = from_ ? *from_ : FromBlock(parameters[0]),
               to = to_ ? *to_ : FromBlock(parameters[to_block]);
  Eigen::Map<PoseVector>{residuals} = MotionError(measured_, from, to);
  if (!jacobians) return true;
  const auto write = [&](size_t block, const Eigen::Matrix<double, 6, 6>& by_step) {
    if (!jacobians[block]) return;
    Eigen::Matrix<double, 6, 7, Eigen::RowMajor> step_by_block;
    PoseManifold().MinusJacobian(parameters[block], step_by_block.data());
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>{jacobians[block]} =
        by_step * step_by_block;
  };
  if (!from_) write(0, derivatives_.by_from);
  if (!to_) write(to_block, derivatives_.by_to);
  return true;
}

}  // namespace oaslam
