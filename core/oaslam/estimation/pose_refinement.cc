#include "oaslam/estimation/pose_refinement.h"

#include <cmath>

#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

constexpr int kMinInliers = 6;  // twice the three points that determine a pose

// Linearises at a pose, by the step of geometry/pose_step.h.
NormalEquations<6> Linearize(const Camera& camera, const Rigid3& pose,
                             std::span<const PointObservation> observations,
                             const std::vector<uint8_t>& use, bool robust) {
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  NormalEquations<6> n;
  PoseVector a, b;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (!use[i]) continue;
    const PointObservation& o = observations[i];
    const Eigen::Vector3d p = r * o.point + pose.translation;
    if (p.z() < kMinDepth) {
      // No step may lower the cost by moving points behind the camera.
      n.cost += robust ? kChi2TwoDof * 4 : kChi2TwoDof;
      continue;
    }
    const double inverse_z = 1 / p.z(), x = p.x() * inverse_z, y = p.y() * inverse_z;
    const double ex = camera.fx * x + camera.cx - o.px.x(),
                 ey = camera.fy * y + camera.cy - o.px.y();
    const double chi2 = (ex * ex + ey * ey) * o.inverse_variance;
    double weight = o.inverse_variance;
    if (robust && chi2 > kChi2TwoDof) {  // Huber's kernel
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

// The prior's error is small, so that a step changes it as it changes the pose.
void AddPrior(const ExpectedPose& prior, const Rigid3& pose, NormalEquations<6>& n) {
  const PoseVector error = StepOf(pose * prior.cam_from_world.Inverse());
  PoseVector weights;
  weights << Eigen::Vector3d::Constant(std::pow(prior.sigma_position, -2)),
      Eigen::Vector3d::Constant(std::pow(prior.sigma_rotation, -2));
  n.cost += error.dot(weights.cwiseProduct(error));
  n.hessian.diagonal() += weights;
  n.gradient += weights.cwiseProduct(error);
}

}  // namespace

PoseCovariance ExpectedPose::Covariance() const {
  PoseVector variances;
  variances << Eigen::Vector3d::Constant(sigma_position * sigma_position),
      Eigen::Vector3d::Constant(sigma_rotation * sigma_rotation);
  return variances.asDiagonal();
}

PoseReport RefinePose(const Camera& camera, const Rigid3& initial_cam_from_world,
                      std::span<const PointObservation> observations,
                      const std::optional<ExpectedPose>& prior) {
  // The last round is without kernel. More rounds and steps would cost time in each frame, and the
  // start is mostly a prediction that is near.
  constexpr int kRounds = 4, kIterations = 8;
  PoseReport report;
  report.cam_from_world = initial_cam_from_world;
  report.inlier.assign(observations.size(), 1);
  report.inliers = static_cast<int>(observations.size());
  const int least = prior ? 0 : kMinInliers;
  for (int round = 0; round < kRounds && report.inliers >= least; ++round) {
    // The first round uses all observations, so that outliers are decided by the kernel and not by
    // the initial pose.
    const bool robust = round < kRounds - 1;
    const NormalEquations<6> end = MinimizeDense<6>(
        {.max_iterations = kIterations, .damping = 1e-6, .raise = 100, .least_raised = 1e-3},
        report.cam_from_world,
        [&](const Rigid3& pose) {
          NormalEquations<6> n = Linearize(camera, pose, observations, report.inlier, robust);
          if (prior) AddPrior(*prior, pose, n);
          return n;
        },
        [](const Rigid3& pose, const PoseVector& step) {
          return std::optional(Moved(pose, step));
        });
    const Eigen::Matrix3d r = report.cam_from_world.rotation.toRotationMatrix();
    int changed = 0;
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
    }
    if (round == kRounds - 1) {
      const auto covariance = CovarianceOf(end);
      report.success = report.inliers >= least && covariance;
      if (report.success) report.covariance = *covariance;
    } else if (changed == 0 && round > 0) {
      round = kRounds - 2;  // the inliers do not change: go to the last round
    }
  }
  return report;
}

}  // namespace oaslam
