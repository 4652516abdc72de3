#include "oaslam/bundle/reprojection_cost.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

using RowMajor23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;
using Matrix27 = Eigen::Matrix<double, 2, 7, Eigen::RowMajor>;
using Matrix76 = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;
using Matrix67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

// At or behind the camera there is no projection: both residuals are a constant of 100 sigmas
// instead (kBehindChi2 in huber.h), so that no step gains by going there.
constexpr double kBehindError = 100;

Eigen::Quaterniond Exp(const Eigen::Vector3d& w) {
  const double half = w.norm() / 2;
  const double s = half < 1e-8 ? 0.5 : std::sin(half) / (2 * half);
  return {std::cos(half), s * w.x(), s * w.y(), s * w.z()};
}

Eigen::Vector3d LogOf(const Eigen::Quaterniond& q) {
  const double s = q.vec().norm();
  if (s < 1e-12) return 2 * q.vec() / q.w();
  return 2 * std::atan2(q.w() < 0 ? -s : s, std::abs(q.w())) / s * q.vec();
}

// d(exp(w) q)/dw at w = 0, rows x y z w: half the quaternion product of each axis with q.
Eigen::Matrix<double, 4, 3> LeftDerivative(const Eigen::Quaterniond& q) {
  Eigen::Matrix<double, 4, 3> d;
  d << q.w(), q.z(), -q.y(), -q.z(), q.w(), q.x(), q.y(), -q.x(), q.w(), -q.x(), -q.y(), -q.z();
  return 0.5 * d;
}

Eigen::Map<const Eigen::Quaterniond> Rotation(const double* pose) {
  return Eigen::Map<const Eigen::Quaterniond>(pose);
}
Eigen::Map<const Eigen::Vector3d> Translation(const double* pose) {
  return Eigen::Map<const Eigen::Vector3d>(pose + 4);
}

// The derivative of q x, which is x + 2 w (v x x) + 2 v x (v x x), by the vector v of q.
Eigen::Matrix3d TurnedByVector(const Eigen::Quaterniond& q, const Eigen::Vector3d& x) {
  const Eigen::Vector3d v = q.vec();
  return -2 * q.w() * Skew(x) +
         2 * (v * x.transpose() + v.dot(x) * Eigen::Matrix3d::Identity() - 2 * x * v.transpose());
}

// Writes the residual of a point in the camera; returns its derivative by that point.
RowMajor23 Project(const Eigen::Vector3d& p, double fx, double fy,
                   const Eigen::Vector2d& px_minus_center, double* residuals) {
  RowMajor23 d = Matrix23::Zero();
  if (p.z() < kMinDepth) {
    residuals[0] = residuals[1] = kBehindError;
    return d;
  }
  const double inverse_z = 1 / p.z(), x = p.x() * inverse_z, y = p.y() * inverse_z;
  residuals[0] = fx * x - px_minus_center.x();
  residuals[1] = fy * y - px_minus_center.y();
  d << fx * inverse_z, 0, -fx * x * inverse_z, 0, fy * inverse_z, -fy * y * inverse_z;
  return d;
}

}  // namespace

PoseBlock ToBlock(const Rigid3& pose) {
  const Eigen::Vector4d& q = pose.rotation.coeffs();
  return {q(0), q(1), q(2), q(3), pose.translation.x(), pose.translation.y(), pose.translation.z()};
}

Rigid3 FromBlock(const double* block) {
  return {Rotation(block).normalized(), Eigen::Vector3d(Translation(block))};
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Quaterniond turn = Exp(Eigen::Map<const Eigen::Vector3d>(delta + 3));
  const Eigen::Quaterniond q = (turn * Rotation(x)).normalized();
  const Eigen::Vector3d t = turn * Translation(x) + Eigen::Map<const Eigen::Vector3d>(delta);
  const PoseBlock moved = ToBlock(Rigid3(q, t));
  std::ranges::copy(moved, x_plus_delta);
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Matrix76> j(jacobian);
  j.setZero();
  j.topRightCorner<4, 3>() = LeftDerivative(Rotation(x));
  j.bottomLeftCorner<3, 3>().setIdentity();
  j.bottomRightCorner<3, 3>() = -Skew(Translation(x));
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Eigen::Quaterniond turn = Rotation(y) * Rotation(x).conjugate();
  Eigen::Map<Eigen::Matrix<double, 6, 1>> difference(y_minus_x);
  difference << Translation(y) - turn * Translation(x), LogOf(turn);
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Matrix67> j(jacobian);
  j.setZero();
  // The columns of LeftDerivative are orthogonal and of length 1/2: its left inverse is four times
  // its transpose.
  const Eigen::Matrix<double, 3, 4> dw = 4 * LeftDerivative(Rotation(x)).transpose();
  j.topLeftCorner<3, 4>() = Skew(Translation(x)) * dw;
  j.topRightCorner<3, 3>().setIdentity();
  j.bottomLeftCorner<3, 4>() = dw;
  return true;
}

ReprojectionCost::ReprojectionCost(const Camera& camera, const Eigen::Vector2d& px, double sigma_px)
    : fx_(camera.fx / sigma_px),
      fy_(camera.fy / sigma_px),
      px_minus_center_((px - Eigen::Vector2d(camera.cx, camera.cy)) / sigma_px) {}

bool ReprojectionCost::Evaluate(const double* const* parameters, double* residuals,
                                double** jacobians) const {
  RowMajor23 by_point_in_cam = Matrix23::Zero();
  const Eigen::Map<const Eigen::Quaterniond> q = Rotation(parameters[0]);
  const Eigen::Map<const Eigen::Vector3d> x(parameters[1]);
  const Eigen::Vector3d v = q.vec(), cross = 2 * v.cross(x);
  if (active_) {
    const Eigen::Vector3d p = x + q.w() * cross + v.cross(cross) + Translation(parameters[0]);
    by_point_in_cam = Project(p, fx_, fy_, px_minus_center_, residuals);
  } else {
    residuals[0] = residuals[1] = 0;
  }
  if (!jacobians) return true;
  if (jacobians[0]) {
    Eigen::Map<Matrix27> j(jacobians[0]);
    j.leftCols<3>().noalias() = by_point_in_cam * TurnedByVector(q, x);
    j.col(3).noalias() = by_point_in_cam * cross;
    j.rightCols<3>() = by_point_in_cam;
  }
  if (jacobians[1])
    Eigen::Map<RowMajor23>(jacobians[1]).noalias() = by_point_in_cam * q.toRotationMatrix();
  return true;
}

DepthCost::DepthCost(const MeasuredDepth& depth, const std::optional<Rigid3>& cam_from_world)
    : z_(depth.z), inverse_sigma_(1 / depth.sigma), fixed_(cam_from_world) {
  if (!fixed_) mutable_parameter_block_sizes()->push_back(7);
  mutable_parameter_block_sizes()->push_back(3);
  set_num_residuals(1);
}

bool DepthCost::Evaluate(const double* const* parameters, double* residuals,
                         double** jacobians) const {
  const int point = fixed_ ? 0 : 1;
  const Eigen::Quaterniond q =
      fixed_ ? Eigen::Quaterniond(fixed_->rotation) : Eigen::Quaterniond(Rotation(parameters[0]));
  const Eigen::Vector3d translation =
      fixed_ ? fixed_->translation : Eigen::Vector3d(Translation(parameters[0]));
  const Eigen::Map<const Eigen::Vector3d> x(parameters[point]);
  const Eigen::Vector3d v = q.vec(), cross = 2 * v.cross(x);
  const Eigen::Vector3d p = x + q.w() * cross + v.cross(cross) + translation;
  const double inverse_sigma = active_ ? inverse_sigma_ : 0;
  residuals[0] = inverse_sigma * (p.z() - z_);
  if (!jacobians) return true;
  if (!fixed_ && jacobians[0]) {
    Eigen::Map<Eigen::RowVector<double, 7>> j(jacobians[0]);
    j << TurnedByVector(q, x).row(2), cross.z(), 0, 0, 1;
    j *= inverse_sigma;
  }
  if (jacobians[point])
    Eigen::Map<Eigen::RowVector3d>(jacobians[point]).noalias() =
        inverse_sigma * q.toRotationMatrix().row(2);
  return true;
}

FixedPoseReprojectionCost::FixedPoseReprojectionCost(const Camera& camera,
                                                     const Rigid3& cam_from_world,
                                                     const Eigen::Vector2d& px, double sigma_px)
    : fx_(camera.fx / sigma_px),
      fy_(camera.fy / sigma_px),
      px_minus_center_((px - Eigen::Vector2d(camera.cx, camera.cy)) / sigma_px),
      rotation_(cam_from_world.rotation.toRotationMatrix()),
      translation_(cam_from_world.translation) {}

bool FixedPoseReprojectionCost::Evaluate(const double* const* parameters, double* residuals,
                                         double** jacobians) const {
  RowMajor23 by_point_in_cam = Matrix23::Zero();
  if (active_) {
    const Eigen::Vector3d p =
        rotation_ * Eigen::Map<const Eigen::Vector3d>(parameters[0]) + translation_;
    by_point_in_cam = Project(p, fx_, fy_, px_minus_center_, residuals);
  } else {
    residuals[0] = residuals[1] = 0;
  }
  if (jacobians && jacobians[0])
    Eigen::Map<RowMajor23>(jacobians[0]).noalias() = by_point_in_cam * rotation_;
  return true;
}

}  // namespace oaslam
