#include "oaslam/estimation/pose_refinement.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

namespace oaslam {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Only prevents a division by zero: the unit of the world is arbitrary.
constexpr double kMinDepth = 1e-6;
constexpr int kMinInliers = 6;

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0;  // sum of kernel(chi^2)
};

// Linearises at a pose. The update acts from the left, x_in_cam <- exp(v, w) x_in_cam, and has the
// derivative [I | -[x]x] (Barfoot 2017, 7.3).
NormalEquations Linearize(const Camera& camera, const Rigid3& pose,
                          std::span<const PointObservation> observations,
                          const std::vector<uint8_t>& use, bool robust) {
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  NormalEquations n;
  Vector6d a, b;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (!use[i]) continue;
    const PointObservation& o = observations[i];
    const Eigen::Vector3d p = r * o.point + pose.translation;
    if (p.z() < kMinDepth) {
      // A step that hides points behind the camera must not pay.
      n.cost += robust ? kChi2TwoDof * 4 : kChi2TwoDof;
      continue;
    }
    const double inverse_z = 1 / p.z(), x = p.x() * inverse_z, y = p.y() * inverse_z;
    const double ex = camera.fx * x + camera.cx - o.px.x(),
                 ey = camera.fy * y + camera.cy - o.px.y();
    const double chi2 = (ex * ex + ey * ey) * o.inverse_variance;
    double weight = o.inverse_variance;
    if (robust && chi2 > kChi2TwoDof) {  // Huber with threshold sqrt(5.991)
      const double chi = std::sqrt(chi2), threshold = std::sqrt(kChi2TwoDof);
      weight *= threshold / chi;
      n.cost += 2 * threshold * chi - kChi2TwoDof;
    } else {
      n.cost += chi2;
    }
    a << inverse_z, 0, -x * inverse_z, -x * y, 1 + x * x, -y;
    b << 0, inverse_z, -y * inverse_z, -1 - y * y, x * y, x;
    const double wx = weight * camera.fx, wy = weight * camera.fy;
    n.hessian.noalias() +=
        (wx * camera.fx * a) * a.transpose() + (wy * camera.fy * b) * b.transpose();
    n.gradient.noalias() += (wx * ex) * a + (wy * ey) * b;
  }
  return n;
}

Rigid3 Moved(const Rigid3& pose, const Vector6d& step) {
  const Eigen::Vector3d w = step.tail<3>();
  const double angle = w.norm();
  const Eigen::Quaterniond rotation = angle < 1e-12
                                          ? Eigen::Quaterniond::Identity()
                                          : Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle));
  return Rigid3(rotation, step.head<3>()) * pose;
}

struct Minimum {
  Rigid3 pose;
  NormalEquations equations;  // at that pose
};

// Levenberg-Marquardt.
Minimum Minimize(const Camera& camera, std::span<const PointObservation> observations,
                 const std::vector<uint8_t>& use, bool robust, int iterations,
                 const Rigid3& start) {
  Rigid3 pose = start;
  NormalEquations here = Linearize(camera, pose, observations, use, robust);
  double damping = 1e-6;
  for (int i = 0; i < iterations; ++i) {
    Matrix6d damped = here.hessian;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12;
    const Vector6d step = damped.ldlt().solve(-here.gradient);
    if (!step.allFinite()) break;
    const Rigid3 moved = Moved(pose, step);
    const NormalEquations there = Linearize(camera, moved, observations, use, robust);
    if (there.cost > here.cost) {
      damping = std::max(damping * 100, 1e-3);
      if (damping > 1e6) break;
      continue;
    }
    const bool converged = here.cost - there.cost < 1e-4 * here.cost;
    pose = moved;
    here = there;
    damping *= 0.1;
    if (converged) break;
  }
  return {pose, here};
}

}  // namespace

PoseReport RefinePose(const Camera& camera, const Rigid3& initial_cam_from_world,
                      std::span<const PointObservation> observations) {
  constexpr int kRounds = 4, kIterations = 8;
  PoseReport report;
  report.cam_from_world = initial_cam_from_world;
  report.inlier.assign(observations.size(), 1);
  report.inliers = static_cast<int>(observations.size());
  for (int round = 0; round < kRounds && report.inliers >= kMinInliers; ++round) {
    // The first round uses all observations, so that outliers are decided by the kernel and not by
    // the initial pose.
    const Minimum end = Minimize(camera, observations, report.inlier, round < kRounds - 1,
                                 kIterations, report.cam_from_world);
    report.cam_from_world = end.pose;
    const Eigen::Matrix3d r = report.cam_from_world.rotation.toRotationMatrix();
    int changed = 0;
    double sum = 0;
    report.inliers = 0;
    for (size_t i = 0; i < observations.size(); ++i) {
      const PointObservation& o = observations[i];
      const Eigen::Vector3d p = r * o.point + report.cam_from_world.translation;
      const double ex = camera.fx * p.x() / p.z() + camera.cx - o.px.x();
      const double ey = camera.fy * p.y() / p.z() + camera.cy - o.px.y();
      const double chi2 = (ex * ex + ey * ey) * o.inverse_variance;
      const uint8_t inlier = p.z() >= kMinDepth && chi2 <= kChi2TwoDof;  // false for NaN
      changed += inlier != report.inlier[i];
      report.inlier[i] = inlier;
      report.inliers += inlier;
      if (inlier) sum += chi2;
    }
    report.rmse_px = report.inliers > 0 ? std::sqrt(sum / report.inliers) : 0;
    if (round == kRounds - 1) {
      const Eigen::LDLT<Matrix6d> factor(end.equations.hessian);
      report.success = report.inliers >= kMinInliers && factor.info() == Eigen::Success &&
                       factor.vectorD().minCoeff() > 1e-12 * factor.vectorD().maxCoeff();
      if (report.success) report.covariance = factor.solve(Matrix6d::Identity());
    } else if (changed == 0 && round > 0) {
      round = kRounds - 2;  // the inliers do not change: go to the last round
    }
  }
  return report;
}

}  // namespace oaslam
