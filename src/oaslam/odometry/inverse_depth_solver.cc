#include "oaslam/odometry/inverse_depth_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "oaslam/estimation/huber.h"
#include "oaslam/estimation/schur_system.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/geometry/skew.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Points nearer than this, times their inverse depth, have no image. Larger than kMinDepth: the
// nearest things are some tenths of the median depth away, which is about 1.
constexpr double kNear = 0.02;

struct Cam {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation, center;
};

std::vector<Cam> CamsOf(const InverseDepthState& state) {
  std::vector<Cam> cams;
  cams.reserve(state.poses.size());
  for (const Rigid3& pose : state.poses)
    cams.push_back({pose.rotation.toRotationMatrix(), pose.translation, pose.OriginInSource()});
  return cams;
}

Eigen::Vector3d ChangeOfVelocity(const VelocityPrior& v, const std::vector<Cam>& cams) {
  return ((cams[v.after].center - cams[v.middle].center) / v.second_s -
          (cams[v.middle].center - cams[v.before].center) / v.first_s) /
         v.sigma;
}

// Of each measurement in turn: the frame of its image from that of its point's anchor.
class Relative {
 public:
  Relative(const InverseDepthProblem& problem, const std::vector<Cam>& cams)
      : problem_(problem), cams_(cams) {}

  void Set(const DepthMeasurement& s) {
    const Cam &to = cams_[s.pose], &from = cams_[problem_.points[s.point].anchor];
    rotation = to.rotation * from.rotation.transpose();
    translation = to.translation - rotation * from.translation;
  }

  double Chi2(const DepthMeasurement& s, double inverse_depth) const {
    const Eigen::Vector3d x =
        rotation * problem_.points[s.point].ray.homogeneous() + inverse_depth * translation;
    if (x.z() < kNear) return kBehindChi2;
    return (s.inverse_sigma * (x.head<2>() / x.z() - s.ray)).squaredNorm();
  }

  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;

 private:
  const InverseDepthProblem& problem_;
  const std::vector<Cam>& cams_;
};

class Solver {
 public:
  Solver(const InverseDepthProblem& problem, const SchurOptions& options)
      : problem_(problem), options_(options), system_(problem.free_poses) {}

  double Cost(const InverseDepthState& state) const { return CostOf(problem_, state); }

  void Linearize(const InverseDepthState& state) {
    const std::vector<Cam> cams = CamsOf(state);
    system_.Clear();
    variances_.clear();
    LinearizePoints(state, cams);
    LinearizePriors(cams);
  }

  bool Step(double damping, InverseDepthState& state) {
    return system_.Step(
        damping,
        [&](int pose, const PoseVector& step) {
          state.poses[pose] = Moved(state.poses[pose], step);
        },
        [&](size_t point, const Eigen::Matrix<double, 1, 1>& step) {
          state.inverse_depths[point] =
              std::max(problem_.least_inverse_depth, state.inverse_depths[point] + step[0]);
        });
  }

  Eigen::MatrixXd Information() { return system_.PoseInformation(); }
  std::vector<double> TakeVariances() { return std::move(variances_); }

 private:
  // The cross blocks of a point, one for each free pose: the sum of what its measurements add.
  struct CrossBlocks {
    std::array<int, 64> pose;
    std::array<Vector6, 64> block;
    int count = 0;

    Vector6& Of(int p) {
      for (int i = 0; i < count; ++i)
        if (pose[i] == p) return block[i];
      OASLAM_CHECK(count < static_cast<int>(pose.size()));
      pose[count] = p;
      block[count].setZero();
      return block[count++];
    }
  };

  void LinearizePoints(const InverseDepthState& state, const std::vector<Cam>& cams) {
    Relative relative(problem_, cams);
    size_t next = 0;
    for (size_t point = 0; point < problem_.points.size(); ++point) {
      const DepthPrior& p = problem_.points[point];
      const double rho = state.inverse_depths[point];
      const bool anchor_free = p.anchor < problem_.free_poses;
      double hessian = 1 / (p.sigma * p.sigma), gradient = (rho - p.inverse_depth) * hessian;
      CrossBlocks cross;
      for (; next < problem_.measurements.size() &&
             problem_.measurements[next].point == static_cast<int>(point);
           ++next) {
        const DepthMeasurement& s = problem_.measurements[next];
        if (s.is_outlier) continue;
        relative.Set(s);
        const Eigen::Vector3d direction = relative.rotation * p.ray.homogeneous(),
                              x = direction + rho * relative.translation;
        if (x.z() < kNear) continue;
        const double inverse_z = 1 / x.z();
        const Eigen::Vector2d projected = x.head<2>() * inverse_z,
                              residual = s.inverse_sigma * (projected - s.ray);
        const double weight = LossOf(residual.squaredNorm(), problem_.huber_chi2).weight;
        Matrix23 by_x;
        by_x << inverse_z, 0, -projected.x() * inverse_z, 0, inverse_z, -projected.y() * inverse_z;
        by_x *= s.inverse_sigma;
        const Eigen::Vector2d by_rho = by_x * relative.translation;
        hessian += weight * by_rho.squaredNorm();
        gradient += weight * by_rho.dot(residual);
        Matrix26 by_pose, by_anchor;
        const bool is_free = s.pose < problem_.free_poses;
        if (is_free) {
          by_pose << rho * by_x, -by_x * Skew(x);
          cross.Of(s.pose) += weight * by_pose.transpose() * by_rho;
          system_.Hessian(s.pose, s.pose).noalias() += weight * by_pose.transpose() * by_pose;
          system_.Gradient(s.pose).noalias() += weight * by_pose.transpose() * residual;
        }
        if (anchor_free) {
          // A step of the anchor moves the point in its frame by the inverse step.
          const Matrix23 by_anchor_point = by_x * relative.rotation;
          by_anchor << -rho * by_anchor_point, by_anchor_point * Skew(p.ray.homogeneous());
          cross.Of(p.anchor) += weight * by_anchor.transpose() * by_rho;
          system_.Hessian(p.anchor, p.anchor).noalias() +=
              weight * by_anchor.transpose() * by_anchor;
          system_.Gradient(p.anchor).noalias() += weight * by_anchor.transpose() * residual;
        }
        if (is_free && anchor_free) {
          if (s.pose > p.anchor)
            system_.Hessian(s.pose, p.anchor).noalias() += weight * by_pose.transpose() * by_anchor;
          else
            system_.Hessian(p.anchor, s.pose).noalias() += weight * by_anchor.transpose() * by_pose;
        }
      }
      for (int i = 0; i < cross.count; ++i) system_.AddCross(cross.pose[i], cross.block[i]);
      system_.AddLandmark(Eigen::Matrix<double, 1, 1>(hessian),
                          Eigen::Matrix<double, 1, 1>(gradient));
      variances_.push_back(1 / hessian);
    }
  }

  // Adds a residual of the camera centres, each of which moves by -R^T v under a step v.
  template <int N>
  void AddCenters(const std::vector<Cam>& cams, const Eigen::Vector3d& residual,
                  const std::array<int, N>& poses,
                  const std::array<Eigen::Matrix3d, N>& by_center) {
    for (int i = 0; i < N; ++i) {
      if (poses[i] >= problem_.free_poses) continue;
      const Eigen::Matrix3d by_i = -by_center[i] * cams[poses[i]].rotation.transpose();
      system_.Gradient(poses[i]).template head<3>() += by_i.transpose() * residual;
      for (int j = 0; j < N; ++j) {
        if (poses[j] > poses[i]) continue;  // both orders come by
        const Eigen::Matrix3d by_j = -by_center[j] * cams[poses[j]].rotation.transpose();
        system_.Hessian(poses[i], poses[j]).template topLeftCorner<3, 3>() +=
            by_i.transpose() * by_j;
      }
    }
  }

  void LinearizePriors(const std::vector<Cam>& cams) {
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    for (const VelocityPrior& v : problem_.velocities) {
      const double first = 1 / (v.first_s * v.sigma), second = 1 / (v.second_s * v.sigma);
      AddCenters<3>(cams, ChangeOfVelocity(v, cams), {v.before, v.middle, v.after},
                    {first * one, -(first + second) * one, second * one});
    }
    if (problem_.length) {
      const LengthPrior& l = *problem_.length;
      const Eigen::Vector3d between = cams[l.second].center - cams[l.first].center;
      const double length = between.norm();
      if (length < kMinDepth) return;
      // A residual along the direction only; the other two are 0, with derivatives of 0.
      Eigen::Matrix3d along = Eigen::Matrix3d::Zero();
      along.row(0) = between.transpose() / (length * l.sigma);
      AddCenters<2>(cams, Eigen::Vector3d((length - l.length) / l.sigma, 0, 0), {l.first, l.second},
                    {-along, along});
    }
  }

  const InverseDepthProblem& problem_;
  SchurOptions options_;
  SchurSystem<1> system_;
  std::vector<double> variances_;
};

}  // namespace

double CostOf(const InverseDepthProblem& problem, const InverseDepthState& state,
              std::optional<double> outlier_chi2) {
  const std::vector<Cam> cams = CamsOf(state);
  Relative relative(problem, cams);
  double cost = 0;
  for (const DepthMeasurement& s : problem.measurements) {
    if (s.is_outlier && !outlier_chi2) continue;
    relative.Set(s);
    const double loss =
        LossOf(relative.Chi2(s, state.inverse_depths[s.point]), problem.huber_chi2).cost;
    cost += outlier_chi2 ? std::min(loss, LossOf(*outlier_chi2, problem.huber_chi2).cost) : loss;
  }
  for (size_t i = 0; i < problem.points.size(); ++i) {
    const DepthPrior& p = problem.points[i];
    const double off = (state.inverse_depths[i] - p.inverse_depth) / p.sigma;
    cost += off * off;
  }
  for (const VelocityPrior& v : problem.velocities) cost += ChangeOfVelocity(v, cams).squaredNorm();
  if (problem.length) {
    const LengthPrior& l = *problem.length;
    const double off = ((cams[l.second].center - cams[l.first].center).norm() - l.length) / l.sigma;
    cost += off * off;
  }
  return cost;
}

void SearchDepths(std::span<const double> candidates, const std::vector<char>& is_searched,
                  const InverseDepthProblem& problem, InverseDepthState& state) {
  const std::vector<Cam> cams = CamsOf(state);
  Relative relative(problem, cams);
  std::vector<double> costs(candidates.size());
  size_t next = 0;
  for (size_t point = 0; point < problem.points.size(); ++point) {
    std::ranges::fill(costs, 0);
    for (; next < problem.measurements.size() &&
           problem.measurements[next].point == static_cast<int>(point);
         ++next) {
      if (!is_searched[point]) continue;
      const DepthMeasurement& s = problem.measurements[next];
      relative.Set(s);
      for (size_t i = 0; i < candidates.size(); ++i)
        costs[i] += LossOf(relative.Chi2(s, candidates[i]), problem.huber_chi2).cost;
    }
    if (is_searched[point])
      state.inverse_depths[point] = candidates[std::ranges::min_element(costs) - costs.begin()];
  }
}

InverseDepthReport MinimizeInverseDepths(const InverseDepthProblem& problem,
                                         const SchurOptions& options, InverseDepthState& state) {
  InverseDepthReport report;
  if (problem.measurements.empty() || problem.free_poses == 0) return report;
  Solver solver(problem, options);
  report.solver = MinimizeBySchur(solver, options, state);
  report.cost = CostOf(problem, state);
  report.information = solver.Information();
  report.variances = solver.TakeVariances();
  return report;
}

}  // namespace oaslam
