#include "oaslam/bundle/intrinsics_solver.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "oaslam/estimation/huber.h"
#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix63 = Eigen::Matrix<double, 6, 3>;
using MatrixPoseShared = Eigen::Matrix<double, 6, kShared>;
using Matrix66 = Eigen::Matrix<double, 6, 6>;
using MatrixSharedPoint = Eigen::Matrix<double, kShared, 3>;
using MatrixShared = Eigen::Matrix<double, kShared, kShared>;
using MatrixPixelShared = Eigen::Matrix<double, 2, kShared>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kHeld = 1e12;  // information that fixes a parameter: far above that of any image
// Keeps blocks invertible. A share of their largest diagonal element, since the unit of length is
// arbitrary; far below what images determine.
constexpr double kRidge = 1e-10;

SharedStep PriorInformation(const IntrinsicsPrior& prior) {
  SharedStep information;
  for (int i = 0; i < kShared; ++i) {
    const double s = prior.sigma[i];
    information[i] = std::isinf(s) ? 0 : s > 0 ? 1 / (s * s) : kHeld;
  }
  return information;
}

SharedStep Difference(const IntrinsicsState& state, const IntrinsicsPrior& prior) {
  const Camera &camera = state.camera, &from = prior.camera;
  SharedStep d;
  d << std::log(camera.fx / from.fx), camera.cx - from.cx, camera.cy - from.cy,
      camera.distortion[0] - from.distortion[0], camera.distortion[1] - from.distortion[1],
      state.readout_s - prior.readout_s;
  return d;
}

class IntrinsicsProblem {
 public:
  IntrinsicsProblem(std::span<const RollingMeasurement> measurements, const IntrinsicsPrior& prior,
                    double huber_chi2, const IntrinsicsState& state)
      : measurements_(measurements),
        prior_(prior),
        prior_information_(PriorInformation(prior)),
        huber_chi2_(huber_chi2),
        cross_(measurements.size()),
        by_pose_(state.poses.size()),
        points_(state.points.size()) {
    first_.assign(state.points.size() + 1, 0);
    for (const RollingMeasurement& s : measurements) ++first_[s.point + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    is_left_out_.resize(state.points.size());
    for (size_t p = 0; p < state.points.size(); ++p) is_left_out_[p] = IsBehind(state, p);
  }

  double Cost(const IntrinsicsState& state) const {
    const SharedStep off = Difference(state, prior_);
    double cost = off.cwiseAbs2().dot(prior_information_);
    for (const RollingMeasurement& s : measurements_) {
      if (is_left_out_[s.point]) continue;
      const Eigen::Vector3d p = state.poses[s.pose] * state.points[s.point];
      double chi2 = kBehindChi2;
      if (p.z() >= kMinDepth)
        chi2 = (PixelOf(state.camera, p) + state.readout_s * s.by_readout - s.px).squaredNorm() *
               s.inverse_sigma * s.inverse_sigma;
      cost += LossOf(chi2, huber_chi2_).cost;
    }
    return cost;
  }

  void Linearize(const IntrinsicsState& state) {
    std::ranges::fill(by_pose_, PoseBlock{});
    intrinsics_hessian_ = prior_information_.asDiagonal();
    const SharedStep off = Difference(state, prior_);
    intrinsics_gradient_ = prior_information_.cwiseProduct(off);
    std::vector<Eigen::Matrix3d> rotations;
    for (const Rigid3& pose : state.poses) rotations.push_back(pose.rotation.toRotationMatrix());
    for (size_t point = 0; point < points_.size(); ++point) LinearizePoint(state, rotations, point);
  }

  // Applies the step that solves the damped equations; returns false if they cannot be solved.
  bool Step(double damping, IntrinsicsState& state) {
    Eigen::MatrixXd system;
    Eigen::VectorXd right;
    Reduce(damping, system, right);
    const auto solution = SolvePositive(system, right);
    if (!solution || !solution->allFinite()) return false;
    const Eigen::VectorXd& step = *solution;
    const SharedStep of_camera = step.tail<kShared>();
    // A change of the focal length by a factor of e is beyond the linear model.
    if (std::abs(of_camera[0]) > 1) return false;
    for (size_t point = 0; point < points_.size(); ++point) {
      const PointBlock& b = points_[point];
      Eigen::Vector3d back = -b.gradient - b.by_intrinsics.transpose() * of_camera;
      for (int i = first_[point]; i < first_[point + 1]; ++i)
        if (measurements_[i].pose > 0)
          back -= cross_[i].transpose() * step.segment<6>(RowOf(measurements_[i].pose));
      state.points[point] += b.inverse * back;
    }
    for (size_t k = 1; k < state.poses.size(); ++k) {
      state.poses[k] = Moved(state.poses[k], step.segment<6>(RowOf(static_cast<int>(k))));
    }
    state.camera = WithIntrinsicsStep(state.camera, of_camera.head<kIntrinsics>());
    state.readout_s += of_camera[kIntrinsics];
    return true;
  }

  MatrixShared Information() {
    Eigen::MatrixXd system;
    Eigen::VectorXd right;
    Reduce(0, system, right);
    if (!FactorisePositive(system)) return MatrixShared::Zero();
    // The intrinsics come last in the factor, so that their part of it is the Schur complement of
    // all others.
    const MatrixShared corner =
        system.bottomRightCorner<kShared, kShared>().triangularView<Eigen::Lower>();
    return corner * corner.transpose();
  }

 private:
  struct PoseBlock {
    Matrix66 hessian = Matrix66::Zero();
    Vector6 gradient = Vector6::Zero();
    MatrixPoseShared by_intrinsics = MatrixPoseShared::Zero();
  };
  struct PointBlock {
    Eigen::Matrix3d hessian, inverse;
    Eigen::Vector3d gradient;
    MatrixSharedPoint by_intrinsics;
  };

  static int RowOf(int pose) { return 6 * (pose - 1); }

  bool IsBehind(const IntrinsicsState& state, size_t point) const {
    for (int i = first_[point]; i < first_[point + 1]; ++i)
      if ((state.poses[measurements_[i].pose] * state.points[point]).z() < kMinDepth) return true;
    return false;
  }

  void LinearizePoint(const IntrinsicsState& state, const std::vector<Eigen::Matrix3d>& rotations,
                      size_t point) {
    PointBlock& b = points_[point];
    b = {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(),
         MatrixSharedPoint::Zero()};
    if (is_left_out_[point] || IsBehind(state, point)) {
      // Behind a camera a point has no useful derivative: it is fixed and has no influence.
      for (int i = first_[point]; i < first_[point + 1]; ++i) cross_[i].setZero();
      b.hessian.setIdentity();
      return;
    }
    for (int i = first_[point]; i < first_[point + 1]; ++i) {
      const RollingMeasurement& s = measurements_[i];
      const Eigen::Vector3d p =
          rotations[s.pose] * state.points[point] + state.poses[s.pose].translation;
      const PixelDerivatives d = PixelWithDerivatives(state.camera, p);
      const Eigen::Vector2d residual =
          s.inverse_sigma * (d.px + state.readout_s * s.by_readout - s.px);
      const double weight = LossOf(residual.squaredNorm(), huber_chi2_).weight;
      const Matrix23 by_p = s.inverse_sigma * d.by_point;
      const Matrix23 by_point = by_p * rotations[s.pose];
      MatrixPixelShared by_intrinsics;
      by_intrinsics << s.inverse_sigma * d.by_intrinsics, s.inverse_sigma * s.by_readout;
      b.hessian.noalias() += weight * by_point.transpose() * by_point;
      b.gradient.noalias() += weight * by_point.transpose() * residual;
      b.by_intrinsics.noalias() += weight * by_intrinsics.transpose() * by_point;
      intrinsics_hessian_.noalias() += weight * by_intrinsics.transpose() * by_intrinsics;
      intrinsics_gradient_.noalias() += weight * by_intrinsics.transpose() * residual;
      if (s.pose == 0) continue;
      const Matrix26 by_pose = DerivativeByPose(by_p, p);
      PoseBlock& pose = by_pose_[s.pose];
      pose.hessian.noalias() += weight * by_pose.transpose() * by_pose;
      pose.gradient.noalias() += weight * by_pose.transpose() * residual;
      pose.by_intrinsics.noalias() += weight * by_pose.transpose() * by_intrinsics;
      cross_[i].noalias() = weight * by_pose.transpose() * by_point;
    }
  }

  // The damped normal equations of poses and intrinsics, lower half, points eliminated.
  void Reduce(double damping, Eigen::MatrixXd& system, Eigen::VectorXd& right) {
    const int poses = static_cast<int>(by_pose_.size()), at = RowOf(poses), n = at + kShared;
    system = Eigen::MatrixXd::Zero(n, n);
    right.resize(n);
    for (int k = 1; k < poses; ++k) {
      auto diagonal = system.block<6, 6>(RowOf(k), RowOf(k));
      diagonal = by_pose_[k].hessian;
      diagonal.diagonal() *= 1 + damping;
      diagonal.diagonal().array() += kRidge * (1 + by_pose_[k].hessian.diagonal().maxCoeff());
      system.block<kShared, 6>(at, RowOf(k)) = by_pose_[k].by_intrinsics.transpose();
      right.segment<6>(RowOf(k)) = -by_pose_[k].gradient;
    }
    auto corner = system.block<kShared, kShared>(at, at);
    corner = intrinsics_hessian_;
    corner.diagonal() *= 1 + damping;
    right.tail<kShared>() = -intrinsics_gradient_;
    for (size_t point = 0; point < points_.size(); ++point)
      Eliminate(point, damping, at, system, right);
  }

  void Eliminate(size_t point, double damping, int at, Eigen::MatrixXd& system,
                 Eigen::VectorXd& right) {
    PointBlock& b = points_[point];
    Eigen::Matrix3d hessian = b.hessian;
    hessian.diagonal() *= 1 + damping;
    hessian.diagonal().array() += kRidge * (1 + hessian.diagonal().maxCoeff());
    b.inverse = hessian.inverse();
    const MatrixSharedPoint of_camera = b.by_intrinsics * b.inverse;
    system.block<kShared, kShared>(at, at).noalias() -= of_camera * b.by_intrinsics.transpose();
    right.tail<kShared>().noalias() += of_camera * b.gradient;
    for (int i = first_[point]; i < first_[point + 1]; ++i) {
      const int pose = measurements_[i].pose;
      if (pose == 0) continue;
      const Matrix63 scaled = cross_[i] * b.inverse;
      right.segment<6>(RowOf(pose)).noalias() += scaled * b.gradient;
      system.block<kShared, 6>(at, RowOf(pose)).noalias() -= of_camera * cross_[i].transpose();
      for (int j = first_[point]; j < first_[point + 1]; ++j) {
        const int other = measurements_[j].pose;
        if (other > 0 && other <= pose)
          system.block<6, 6>(RowOf(pose), RowOf(other)).noalias() -= scaled * cross_[j].transpose();
      }
    }
  }

  std::span<const RollingMeasurement> measurements_;
  IntrinsicsPrior prior_;
  SharedStep prior_information_;
  double huber_chi2_;
  std::vector<int> first_;  // index of the first measurement of each point
  // Points that are behind a camera from the start: their residuals would be wrong.
  std::vector<char> is_left_out_;
  std::vector<Matrix63> cross_;  // by measurement: pose by point
  std::vector<PoseBlock> by_pose_;
  std::vector<PointBlock> points_;
  MatrixShared intrinsics_hessian_;
  SharedStep intrinsics_gradient_;
};

}  // namespace

MinimizationReport MinimizeWithIntrinsics(std::span<const RollingMeasurement> measurements,
                                          const IntrinsicsPrior& prior, const SchurOptions& options,
                                          IntrinsicsState& state) {
  if (measurements.empty() || state.poses.size() < 2) return {};
  IntrinsicsProblem problem(measurements, prior, options.huber_chi2, state);
  return MinimizeLevenbergMarquardt(problem, options.Loop(), state);
}

Eigen::Matrix<double, kShared, kShared> InformationOnIntrinsics(
    std::span<const RollingMeasurement> measurements, const IntrinsicsPrior& prior,
    const IntrinsicsState& state) {
  if (measurements.empty() || state.poses.size() < 2) return MatrixShared::Zero();
  IntrinsicsProblem problem(measurements, prior, 0, state);
  problem.Linearize(state);
  return problem.Information();
}

}  // namespace oaslam
