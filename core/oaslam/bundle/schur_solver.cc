#include "oaslam/bundle/schur_solver.h"

#include <Eigen/Geometry>

#include "oaslam/estimation/huber.h"
#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/estimation/schur_system.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;

using Matrix63 = Eigen::Matrix<double, 6, 3>;

struct Cam {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

class ReprojectionProblem {
 public:
  ReprojectionProblem(std::span<const PointMeasurement> measurements,
                      std::span<const MotionMeasurement> motions, int free_poses,
                      const SchurOptions& options, const CamerasAndPoints& state)
      : measurements_(measurements),
        motions_(motions),
        free_poses_(free_poses),
        options_(options),
        system_(free_poses) {
    first_.assign(state.points.size() + 1, 0);
    for (const PointMeasurement& s : measurements) ++first_[s.point + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    const std::vector<Cam> cams = CamsOf(state);
    is_left_out_.resize(state.points.size());
    for (size_t point = 0; point < state.points.size(); ++point)
      is_left_out_[point] = IsBehind(point, state.points[point], cams);
  }

  double Cost(const CamerasAndPoints& state) const {
    const std::vector<Cam> cams = CamsOf(state);
    double cost = 0;
    for (const PointMeasurement& s : measurements_) {
      if (is_left_out_[s.point]) continue;
      const Eigen::Vector3d p =
          cams[s.pose].rotation * state.points[s.point] + cams[s.pose].translation;
      cost += LossOf(p.z() < kMinDepth ? kBehindChi2
                                       : ResidualOf(s, p, *state.cameras[s.pose]).squaredNorm(),
                     options_.huber_chi2)
                  .cost;
      if (s.depth.z > 0) cost += LossOf(Square(DepthError(s.depth, p)), kChi2OneDof).cost;
    }
    for (const MotionMeasurement& m : motions_)
      cost += LossOf(MotionError(m, state.poses[m.from], state.poses[m.to]).squaredNorm(),
                     m.huber_chi2())
                  .cost;
    return cost;
  }

  void Linearize(const CamerasAndPoints& state) {
    const std::vector<Cam> cams = CamsOf(state);
    system_.Clear();
    for (size_t point = 0; point + 1 < first_.size(); ++point) {
      Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      if (is_left_out_[point] || IsBehind(point, state.points[point], cams)) {
        // A point behind a camera has no useful derivative: it is fixed and has no influence.
        system_.AddLandmark(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
        continue;
      }
      for (int i = first_[point]; i < first_[point + 1]; ++i) {
        const PointMeasurement& s = measurements_[i];
        const Cam& cam = cams[s.pose];
        const Eigen::Vector3d p = cam.rotation * state.points[point] + cam.translation;
        const Eigen::Vector2d residual = ResidualOf(s, p, *state.cameras[s.pose]);
        const double weight = LossOf(residual.squaredNorm(), options_.huber_chi2).weight;
        const Matrix23 by_p = Derivative(s, p, *state.cameras[s.pose]);
        const Matrix23 by_point = by_p * cam.rotation;
        hessian.noalias() += weight * by_point.transpose() * by_point;
        gradient.noalias() += weight * by_point.transpose() * residual;
        const DepthRow depth = s.depth.z > 0 ? RowOf(s.depth, cam, p) : DepthRow{};
        if (s.depth.z > 0) {
          hessian.noalias() += depth.weight * depth.by_point.transpose() * depth.by_point;
          gradient.noalias() += depth.weight * depth.by_point.transpose() * depth.error;
        }
        if (s.pose >= free_poses_) continue;
        const Matrix26 by_pose = DerivativeByPose(by_p, p);
        system_.Hessian(s.pose, s.pose).noalias() += weight * by_pose.transpose() * by_pose;
        system_.Gradient(s.pose).noalias() += weight * by_pose.transpose() * residual;
        Matrix63 cross = weight * by_pose.transpose() * by_point;
        if (s.depth.z > 0) {
          system_.Hessian(s.pose, s.pose).noalias() +=
              depth.weight * depth.by_pose.transpose() * depth.by_pose;
          system_.Gradient(s.pose).noalias() +=
              depth.weight * depth.by_pose.transpose() * depth.error;
          cross.noalias() += depth.weight * depth.by_pose.transpose() * depth.by_point;
        }
        system_.AddCross(s.pose, cross);
      }
      system_.AddLandmark(hessian, gradient);
    }
    for (const MotionMeasurement& m : motions_) AddMotion(m, state);
  }

  // Applies the step that solves the damped equations; returns false if they cannot be solved.
  bool Step(double damping, CamerasAndPoints& state) {
    return system_.Step(
        damping,
        [&](int pose, const PoseVector& step) {
          state.poses[pose] = Moved(state.poses[pose], step);
        },
        [&](size_t point, const Eigen::Vector3d& step) { state.points[point] += step; });
  }

 private:
  // The error of a measured depth, and its derivatives.
  struct DepthRow {
    double error = 0, weight = 0;
    Eigen::RowVector3d by_point = Eigen::RowVector3d::Zero();
    Eigen::Matrix<double, 1, 6> by_pose = Eigen::Matrix<double, 1, 6>::Zero();
  };

  static double Square(double x) { return x * x; }
  static double DepthError(const MeasuredDepth& depth, const Eigen::Vector3d& p) {
    return (p.z() - depth.z) / depth.sigma;
  }
  static DepthRow RowOf(const MeasuredDepth& depth, const Cam& cam, const Eigen::Vector3d& p) {
    DepthRow row;
    row.error = DepthError(depth, p);
    row.weight = LossOf(Square(row.error), kChi2OneDof).weight;
    row.by_point = cam.rotation.row(2) / depth.sigma;
    row.by_pose << 0, 0, 1, p.y(), -p.x(), 0;
    row.by_pose /= depth.sigma;
    return row;
  }

  void AddMotion(const MotionMeasurement& m, const CamerasAndPoints& state) {
    const PoseVector error = MotionError(m, state.poses[m.from], state.poses[m.to]);
    const double weight = LossOf(error.squaredNorm(), m.huber_chi2()).weight;
    const MotionDerivatives by = DerivativesOf(m);
    const bool from_is_free = m.from < free_poses_, to_is_free = m.to < free_poses_;
    if (from_is_free) {
      system_.Hessian(m.from, m.from).noalias() += weight * by.by_from.transpose() * by.by_from;
      system_.Gradient(m.from).noalias() += weight * by.by_from.transpose() * error;
    }
    if (to_is_free) {
      system_.Hessian(m.to, m.to).noalias() += weight * by.by_to.transpose() * by.by_to;
      system_.Gradient(m.to).noalias() += weight * by.by_to.transpose() * error;
    }
    if (!from_is_free || !to_is_free) return;
    const Eigen::Matrix<double, 6, 6> cross = weight * by.by_to.transpose() * by.by_from;
    if (m.to > m.from)
      system_.Hessian(m.to, m.from) += cross;
    else
      system_.Hessian(m.from, m.to) += cross.transpose();
  }

  static std::vector<Cam> CamsOf(const CamerasAndPoints& state) {
    std::vector<Cam> cams;
    cams.reserve(state.poses.size());
    for (const Rigid3& pose : state.poses)
      cams.push_back({pose.rotation.toRotationMatrix(), pose.translation});
    return cams;
  }

  static Eigen::Vector2d ResidualOf(const PointMeasurement& s, const Eigen::Vector3d& p,
                                    const Camera& camera) {
    const double inverse_z = 1 / p.z();
    return s.inverse_sigma * Eigen::Vector2d(camera.fx * p.x() * inverse_z + camera.cx - s.px.x(),
                                             camera.fy * p.y() * inverse_z + camera.cy - s.px.y());
  }

  static Matrix23 Derivative(const PointMeasurement& s, const Eigen::Vector3d& p,
                             const Camera& camera) {
    const double inverse_z = 1 / p.z(), fx = s.inverse_sigma * camera.fx * inverse_z,
                 fy = s.inverse_sigma * camera.fy * inverse_z;
    Matrix23 d;
    d << fx, 0, -fx * p.x() * inverse_z, 0, fy, -fy * p.y() * inverse_z;
    return d;
  }

  bool IsBehind(size_t point, const Eigen::Vector3d& x, const std::vector<Cam>& cams) const {
    for (int i = first_[point]; i < first_[point + 1]; ++i) {
      const Cam& cam = cams[measurements_[i].pose];
      if (cam.rotation.row(2).dot(x) + cam.translation.z() < kMinDepth) return true;
    }
    return false;
  }

  std::span<const PointMeasurement> measurements_;
  std::span<const MotionMeasurement> motions_;
  int free_poses_;
  SchurOptions options_;
  std::vector<int> first_;  // index of the first measurement of each point
  // Points that are behind a camera from the start: their residuals would be wrong.
  std::vector<char> is_left_out_;
  SchurSystem<3> system_;
};

}  // namespace

MinimizationReport MinimizeReprojection(std::span<const PointMeasurement> measurements,
                                        int free_poses, const SchurOptions& options,
                                        CamerasAndPoints& state,
                                        std::span<const MotionMeasurement> motions) {
  OASLAM_CHECK(free_poses <= static_cast<int>(state.poses.size()));
  if (measurements.empty() || free_poses == 0) return {};
  ReprojectionProblem problem(measurements, motions, free_poses, options, state);
  return MinimizeLevenbergMarquardt(problem, options.Loop(), state);
}

}  // namespace oaslam
