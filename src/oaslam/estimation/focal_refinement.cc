#include "oaslam/estimation/focal_refinement.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "oaslam/geometry/camera_derivatives.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

constexpr double kMinDepth = 1e-6;
constexpr int kMinInliers = 8;

struct State {
  Camera camera;
  Rigid3 pose;
};

struct NormalEquations {
  Matrix7 hessian = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  double cost = 0;
};

double Chi2(const State& state, const PointObservation& o) {
  const Eigen::Vector3d p = state.pose * o.point;
  if (p.z() < kMinDepth) return std::numeric_limits<double>::infinity();
  return (ProjectIdeal(state.camera, p) - o.px).squaredNorm() * o.inverse_variance;
}

NormalEquations Linearize(const State& state, std::span<const PointObservation> observations,
                          const std::vector<uint8_t>& use, bool robust) {
  NormalEquations n;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (!use[i]) continue;
    const PointObservation& o = observations[i];
    const Eigen::Vector3d p = state.pose * o.point;
    if (p.z() < kMinDepth) {
      // A step that hides points behind the camera must not pay.
      n.cost += robust ? kChi2TwoDof * 4 : kChi2TwoDof;
      continue;
    }
    const double fx = state.camera.fx, fy = state.camera.fy, inverse_z = 1 / p.z(),
                 x = p.x() * inverse_z, y = p.y() * inverse_z;
    const Eigen::Vector2d e(fx * x + state.camera.cx - o.px.x(),
                            fy * y + state.camera.cy - o.px.y());
    const double chi2 = e.squaredNorm() * o.inverse_variance;
    double weight = o.inverse_variance;
    if (robust && chi2 > kChi2TwoDof) {
      const double root = std::sqrt(kChi2TwoDof * chi2);
      weight *= root / chi2;
      n.cost += 2 * root - kChi2TwoDof;
    } else {
      n.cost += chi2;
    }
    Vector7 a, b;
    a << fx * inverse_z, 0, -fx * x * inverse_z, -fx * x * y, fx * (1 + x * x), -fx * y, fx * x;
    b << 0, fy * inverse_z, -fy * y * inverse_z, -fy * (1 + y * y), fy * x * y, fy * x, fy * y;
    n.hessian.noalias() += weight * (a * a.transpose() + b * b.transpose());
    n.gradient.noalias() += weight * (e.x() * a + e.y() * b);
  }
  return n;
}

State Moved(const State& state, const Vector7& step) {
  const Eigen::Vector3d w = step.segment<3>(3);
  const double angle = w.norm();
  const Eigen::Quaterniond turn = angle < 1e-12
                                      ? Eigen::Quaterniond::Identity()
                                      : Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle));
  IntrinsicsStep of_camera = IntrinsicsStep::Zero();
  of_camera[0] = step[6];
  return {Changed(state.camera, of_camera), Rigid3(turn, step.head<3>()) * state.pose};
}

NormalEquations Minimize(std::span<const PointObservation> observations,
                         const std::vector<uint8_t>& use, bool robust, State& state) {
  constexpr int kIterations = 20;
  NormalEquations here = Linearize(state, observations, use, robust);
  double damping = 1e-4;
  for (int i = 0; i < kIterations && damping < 1e6; ++i) {
    Matrix7 damped = here.hessian;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12;
    const Vector7 step = damped.ldlt().solve(-here.gradient);
    if (!step.allFinite()) break;
    if (std::abs(step[6]) > 0.5) {
      damping = std::max(damping * 10, 1e-3);
      continue;
    }
    const State moved = Moved(state, step);
    const NormalEquations there = Linearize(moved, observations, use, robust);
    if (there.cost > here.cost) {
      damping = std::max(damping * 100, 1e-3);
      continue;
    }
    const bool converged = here.cost - there.cost < 1e-5 * here.cost;
    state = moved;
    here = there;
    damping *= 0.1;
    if (converged) break;
  }
  return here;
}

}  // namespace

FocalReport RefinePoseAndFocal(const Camera& camera, const Rigid3& initial_cam_from_world,
                               std::span<const PointObservation> observations) {
  constexpr int kRounds = 4;
  FocalReport report;
  State state{camera, initial_cam_from_world};
  report.inlier.assign(observations.size(), 1);
  report.inliers = static_cast<int>(observations.size());
  NormalEquations end;
  for (int round = 0; round < kRounds && report.inliers >= kMinInliers; ++round) {
    end = Minimize(observations, report.inlier, round < kRounds - 1, state);
    report.inliers = 0;
    report.chi2 = 0;
    for (size_t i = 0; i < observations.size(); ++i) {
      const double chi2 = Chi2(state, observations[i]);
      report.inlier[i] = chi2 <= kChi2TwoDof;
      report.inliers += report.inlier[i];
      if (report.inlier[i]) report.chi2 += chi2;
    }
  }
  report.camera = state.camera;
  report.cam_from_world = state.pose;
  const Eigen::LDLT<Matrix7> factor(end.hessian);
  report.success = report.inliers >= kMinInliers && factor.info() == Eigen::Success &&
                   factor.vectorD().minCoeff() > 1e-12 * factor.vectorD().maxCoeff();
  if (!report.success) return report;
  const Matrix7 covariance = factor.solve(Matrix7::Identity());
  report.relative_sigma = std::sqrt(std::max(0.0, covariance(6, 6)));
  report.covariance = covariance.topLeftCorner<6, 6>();
  return report;
}

}  // namespace oaslam
