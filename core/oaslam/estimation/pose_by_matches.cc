#include "oaslam/estimation/pose_by_matches.h"

#include <array>
#include <cmath>
#include <vector>

#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

void AddLandmarks(const Camera& camera, const Rigid3& pose,
                  std::span<const PointObservation> landmarks, const std::vector<uint8_t>& use,
                  NormalEquations<6>& n) {
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  const double threshold = std::sqrt(kChi2TwoDof);
  for (size_t i = 0; i < landmarks.size(); ++i) {
    if (!use[i]) continue;
    const PointObservation& o = landmarks[i];
    const Eigen::Vector3d p = r * o.point + pose.translation;
    if (!(p.z() > 0)) {
      n.cost += 4 * kChi2TwoDof;
      continue;
    }
    const double x = p.x() / p.z(), y = p.y() / p.z();
    const Eigen::Vector2d e(camera.fx * x + camera.cx - o.px.x(),
                            camera.fy * y + camera.cy - o.px.y());
    const double chi = std::sqrt(e.squaredNorm() * o.inverse_variance);
    const double weight = o.inverse_variance * (chi > threshold ? threshold / chi : 1);
    n.cost += chi > threshold ? 2 * threshold * chi - kChi2TwoDof : chi * chi;
    Eigen::Matrix<double, 2, 6> j;
    j << 1 / p.z(), 0, -x / p.z(), -x * y, 1 + x * x, -y, 0, 1 / p.z(), -y / p.z(), -1 - y * y,
        x * y, x;
    j.row(0) *= camera.fx;
    j.row(1) *= camera.fy;
    n.hessian.noalias() += weight * j.transpose() * j;
    n.gradient.noalias() += weight * j.transpose() * e;
  }
}

void AddMatches(const Camera& camera, const Rigid3& relative,
                std::span<const EpipolarMatch> matches, NormalEquations<6>& n) {
  constexpr double kKernel2 = 4;  // full weight well within two sigma
  if (relative.translation.norm() < 1e-9) return;
  const Eigen::Matrix3d r = relative.rotation.toRotationMatrix(),
                        t_hat = Skew(relative.translation), e = t_hat * r;
  // Derivatives of E: a motion (v, w) changes t to t + v + w x t, and R to exp(w) R.
  std::array<Eigen::Matrix3d, 6> derivative;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(k);
    derivative[k] = Skew(unit) * r;
    derivative[3 + k] = (Skew(unit.cross(relative.translation)) + t_hat * Skew(unit)) * r;
  }
  const double w2 = 1 / (camera.fx * camera.fy);
  for (const EpipolarMatch& m : matches) {
    const Eigen::Vector3d ex = e * m.ray_before, ey = e.transpose() * m.ray;
    const double variance = w2 * (ex.head<2>().squaredNorm() + ey.head<2>().squaredNorm());
    if (!(variance > 1e-24)) continue;
    const double inverse_norm = 1 / std::sqrt(variance), inverse_sigma = inverse_norm / m.sigma_px;
    const double residual = m.ray.dot(ex) * inverse_sigma;
    PoseVector j;
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector3d dx = derivative[k] * m.ray_before,
                            dy = derivative[k].transpose() * m.ray;
      const double half_dvariance =
          w2 * (ex.head<2>().dot(dx.head<2>()) + ey.head<2>().dot(dy.head<2>()));
      j(k) =
          inverse_sigma * m.ray.dot(dx) - residual * inverse_norm * inverse_norm * half_dvariance;
    }
    const double weight = 1 / (1 + residual * residual / kKernel2);
    n.cost += kKernel2 * std::log1p(residual * residual / kKernel2);
    n.hessian.noalias() += weight * j * j.transpose();
    n.gradient.noalias() += weight * residual * j;
  }
}

}  // namespace

PoseReport RefinePoseByMatches(const Camera& camera, const Rigid3& initial,
                               std::span<const PointObservation> landmarks,
                               const Rigid3& before_from_world,
                               std::span<const EpipolarMatch> matches) {
  // RefinePose has a fourth round, without kernel; the kernel of matches stays.
  constexpr int kRounds = 3, kIterations = 8, kMinInliers = 6;
  const Rigid3 world_from_before = before_from_world.Inverse();
  PoseReport report;
  report.cam_from_world = initial;
  report.inlier.assign(landmarks.size(), 1);
  NormalEquations<6> end;
  const auto linearize = [&](const Rigid3& pose) {
    NormalEquations<6> n;
    AddLandmarks(camera, pose, landmarks, report.inlier, n);
    AddMatches(camera, pose * world_from_before, matches, n);
    return n;
  };
  for (int round = 0; round < kRounds; ++round) {
    end = MinimizeDense<6>({.max_iterations = kIterations}, report.cam_from_world, linearize,
                           [](const Rigid3& pose, const PoseVector& step) {
                             return std::optional(Moved(pose, step));
                           });
    report.inliers = 0;
    for (size_t i = 0; i < landmarks.size(); ++i) {
      const PointObservation& o = landmarks[i];
      const Eigen::Vector3d p = report.cam_from_world * o.point;
      const Eigen::Vector2d px(camera.fx * p.x() / p.z() + camera.cx,
                               camera.fy * p.y() / p.z() + camera.cy);
      report.inlier[i] = p.z() > 0 && (px - o.px).squaredNorm() * o.inverse_variance <= kChi2TwoDof;
      report.inliers += report.inlier[i];
    }
    if (report.inliers < kMinInliers) return report;
  }
  const auto covariance = CovarianceOf(end);
  report.success = covariance.has_value();
  if (covariance) report.covariance = *covariance;
  return report;
}

}  // namespace oaslam
