#include "oaslam/estimation/focal_refinement.h"

#include <cmath>

#include "oaslam/estimation/huber.h"
#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/camera_derivatives.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;

constexpr int kMinInliers = 8;  // twice the four points that determine seven parameters

struct State {
  Camera camera;
  Rigid3 pose;
};

double Chi2(const State& state, const PointObservation& o) {
  const Eigen::Vector3d p = state.pose * o.point;
  if (p.z() < kMinDepth) return std::numeric_limits<double>::infinity();
  return (ProjectIdeal(state.camera, p) - o.px).squaredNorm() * o.inverse_variance;
}

NormalEquations<7> Linearize(const State& state, std::span<const PointObservation> observations,
                             const std::vector<uint8_t>& use, bool robust) {
  NormalEquations<7> n;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (!use[i]) continue;
    const PointObservation& o = observations[i];
    const Eigen::Vector3d p = state.pose * o.point;
    if (p.z() < kMinDepth) {
      // No step may lower the cost by moving points behind the camera.
      n.cost += robust ? kChi2TwoDof * 4 : kChi2TwoDof;
      continue;
    }
    const double fx = state.camera.fx, fy = state.camera.fy, inverse_z = 1 / p.z(),
                 x = p.x() * inverse_z, y = p.y() * inverse_z;
    const Eigen::Vector2d e(fx * x + state.camera.cx - o.px.x(),
                            fy * y + state.camera.cy - o.px.y());
    const double chi2 = e.squaredNorm() * o.inverse_variance;
    const Loss loss = LossOf(chi2, robust ? kChi2TwoDof : 0);
    const double weight = o.inverse_variance * loss.weight;
    n.cost += loss.cost;
    Vector7 a, b;
    a << fx * inverse_z, 0, -fx * x * inverse_z, -fx * x * y, fx * (1 + x * x), -fx * y, fx * x;
    b << 0, fy * inverse_z, -fy * y * inverse_z, -fy * (1 + y * y), fy * x * y, fy * x, fy * y;
    n.hessian.noalias() += weight * (a * a.transpose() + b * b.transpose());
    n.gradient.noalias() += weight * (e.x() * a + e.y() * b);
  }
  return n;
}

// Nothing where a step changes the focal length by more than a factor of 1.65: the model is linear
// only below that.
std::optional<State> MovedState(const State& state, const Vector7& step) {
  constexpr double kMaxFocalStep = 0.5;  // of its logarithm
  if (std::abs(step[6]) > kMaxFocalStep) return std::nullopt;
  IntrinsicsStep of_camera = IntrinsicsStep::Zero();
  of_camera[0] = step[6];
  return State{WithIntrinsicsStep(state.camera, of_camera), Moved(state.pose, step.head<6>())};
}

}  // namespace

FocalReport RefinePoseAndFocal(const Camera& camera, const Rigid3& initial_cam_from_world,
                               std::span<const PointObservation> observations) {
  constexpr int kRounds = 4;  // as in RefinePose
  FocalReport report;
  State state{camera, initial_cam_from_world};
  report.inlier.assign(observations.size(), 1);
  report.inliers = static_cast<int>(observations.size());
  NormalEquations<7> end;
  for (int round = 0; round < kRounds && report.inliers >= kMinInliers; ++round) {
    const bool robust = round < kRounds - 1;
    end = MinimizeDense<7>(
        {.tolerance = 1e-5, .raise = 100, .least_raised = 1e-3}, state,
        [&](const State& s) { return Linearize(s, observations, report.inlier, robust); },
        MovedState);
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
  const auto covariance = CovarianceOf(end);
  report.success = report.inliers >= kMinInliers && covariance;
  if (!report.success) return report;
  report.relative_sigma = std::sqrt(std::max(0.0, (*covariance)(6, 6)));
  report.covariance = covariance->topLeftCorner<6, 6>();
  return report;
}

}  // namespace oaslam
