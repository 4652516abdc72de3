#include "oaslam/odometry/inverse_depth_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "oaslam/estimation/huber.h"
#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/estimation/schur_system.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/geometry/skew.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

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

// In units of its sigma, about the axes of the second image.
Eigen::Vector3d RotationError(const RotationPrior& r, const std::vector<Cam>& cams) {
  const Eigen::AngleAxisd off(cams[r.second].rotation * cams[r.first].rotation.transpose() *
                              r.turn.second_from_first.toRotationMatrix().transpose());
  return off.angle() / std::sqrt(r.turn.variance) * off.axis();
}

// The relative pose of the image of a measurement and its point's anchor.
struct Pair {
  int pose = 0, anchor = 0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // pose_from_anchor
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d PointAt(const Eigen::Vector2d& ray, double inverse_depth) const {
    return rotation * ray.homogeneous() + inverse_depth * translation;
  }
  double Chi2(const DepthMeasurement& s, const Eigen::Vector2d& ray, double inverse_depth) const {
    const Eigen::Vector3d x = PointAt(ray, inverse_depth);
    if (x.z() < kNearest) return kBehindChi2;
    return (s.inverse_sigma * (x.head<2>() / x.z() - s.ray)).squaredNorm();
  }
};

// All pairs of a problem: there are far fewer of them than measurements.
class Pairs {
 public:
  Pairs(const InverseDepthProblem& problem, size_t poses) {
    std::vector<int> index(poses * poses, -1);
    for (const DepthMeasurement& s : problem.measurements) {
      const int anchor = problem.points[s.point].anchor;
      int& i = index[s.pose * poses + anchor];
      if (i < 0) {
        i = static_cast<int>(pairs_.size());
        pairs_.push_back({.pose = s.pose, .anchor = anchor});
      }
      pair_of_.push_back(i);
    }
  }

  void Update(const std::vector<Cam>& cams) {
    for (Pair& p : pairs_) {
      p.rotation = cams[p.pose].rotation * cams[p.anchor].rotation.transpose();
      p.translation = cams[p.pose].translation - p.rotation * cams[p.anchor].translation;
    }
  }

  size_t size() const { return pairs_.size(); }
  const Pair& operator[](size_t i) const { return pairs_[i]; }
  int OfMeasurement(size_t measurement) const { return pair_of_[measurement]; }

 private:
  std::vector<Pair> pairs_;
  std::vector<int> pair_of_;
};

double Cost(const InverseDepthProblem& problem, const InverseDepthState& state,
            std::optional<double> outlier_chi2, Pairs& pairs) {
  const std::vector<Cam> cams = CamsOf(state);
  pairs.Update(cams);
  const double most = outlier_chi2 ? LossOf(*outlier_chi2, problem.huber_chi2).cost
                                   : std::numeric_limits<double>::infinity();
  double cost = 0;
  for (size_t i = 0; i < problem.measurements.size(); ++i) {
    const DepthMeasurement& s = problem.measurements[i];
    if (s.is_outlier && !outlier_chi2) continue;
    const double chi2 = pairs[pairs.OfMeasurement(i)].Chi2(s, problem.points[s.point].ray,
                                                           state.inverse_depths[s.point]);
    cost += std::min(most, LossOf(chi2, problem.huber_chi2).cost);
  }
  for (size_t i = 0; i < problem.points.size(); ++i) {
    const DepthPrior& p = problem.points[i];
    const double off = (state.inverse_depths[i] - p.inverse_depth) / p.sigma;
    cost += off * off;
  }
  for (const VelocityPrior& v : problem.velocities) cost += ChangeOfVelocity(v, cams).squaredNorm();
  for (const RotationPrior& r : problem.rotations) cost += RotationError(r, cams).squaredNorm();
  if (problem.length) {
    const LengthPrior& l = *problem.length;
    const double off = ((cams[l.second].center - cams[l.first].center).norm() - l.length) / l.sigma;
    cost += off * off;
  }
  return cost;
}

class WindowEquations {
 public:
  WindowEquations(const InverseDepthProblem& problem, size_t poses)
      : problem_(problem), pairs_(problem, poses), system_(problem.free_poses) {}

  double Cost(const InverseDepthState& state) {
    return oaslam::Cost(problem_, state, std::nullopt, pairs_);
  }

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

  // The sums over the measurements of a pair, by a step of its image.
  struct PairBlock {
    Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 gradient = Vector6::Zero();
  };

  void LinearizePoints(const InverseDepthState& state, const std::vector<Cam>& cams) {
    pairs_.Update(cams);
    std::vector<PairBlock> blocks(pairs_.size());
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
        const Pair& pair = pairs_[pairs_.OfMeasurement(next)];
        const Eigen::Vector3d x = pair.PointAt(p.ray, rho);
        if (x.z() < kNearest) continue;
        const double inverse_z = 1 / x.z();
        const Eigen::Vector2d projected = x.head<2>() * inverse_z,
                              residual = s.inverse_sigma * (projected - s.ray);
        const double weight = LossOf(residual.squaredNorm(), problem_.huber_chi2).weight;
        Matrix23 by_x;
        by_x << inverse_z, 0, -projected.x() * inverse_z, 0, inverse_z, -projected.y() * inverse_z;
        by_x *= s.inverse_sigma;
        const Eigen::Vector2d by_rho = by_x * pair.translation;
        hessian += weight * by_rho.squaredNorm();
        gradient += weight * by_rho.dot(residual);
        const bool is_free = s.pose < problem_.free_poses;
        if (!is_free && !anchor_free) continue;
        Matrix26 by_pose;
        by_pose << rho * by_x, -by_x * Skew(x);
        const Vector6 cross_of_pose = weight * by_pose.transpose() * by_rho;
        PairBlock& block = blocks[pairs_.OfMeasurement(next)];
        block.hessian.noalias() += (weight * by_pose).transpose() * by_pose;
        block.gradient.noalias() += weight * by_pose.transpose() * residual;
        if (is_free) cross.Of(s.pose) += cross_of_pose;
        if (anchor_free) cross.Of(p.anchor) += OfAnchor(pair, cross_of_pose);
      }
      for (int i = 0; i < cross.count; ++i) system_.AddCross(cross.pose[i], cross.block[i]);
      system_.AddLandmark(Eigen::Matrix<double, 1, 1>(hessian),
                          Eigen::Matrix<double, 1, 1>(gradient));
      variances_.push_back(1 / hessian);
    }
    for (size_t i = 0; i < blocks.size(); ++i) AddPair(pairs_[i], blocks[i]);
  }

  // A step of the anchor moves points as the opposite step of the image does, in the frame of the
  // image: by the adjoint of the relative pose (Barfoot 2017, 7.1.4). From a derivative by the
  // step of the image, that by the step of the anchor.
  static Vector6 OfAnchor(const Pair& pair, const Vector6& by_image) {
    const Eigen::Vector3d v = by_image.head<3>(), w = by_image.tail<3>();
    Vector6 by_anchor;
    by_anchor << -(pair.rotation.transpose() * v),
        pair.rotation.transpose() * (pair.translation.cross(v) - w);
    return by_anchor;
  }

  void AddPair(const Pair& pair, const PairBlock& block) {
    const bool is_free = pair.pose < problem_.free_poses,
               anchor_free = pair.anchor < problem_.free_poses;
    if (is_free) {
      system_.Hessian(pair.pose, pair.pose) += block.hessian;
      system_.Gradient(pair.pose) += block.gradient;
    }
    if (!anchor_free) return;
    Eigen::Matrix<double, 6, 6> cross, anchor;  // anchor by image, anchor by anchor
    for (int i = 0; i < 6; ++i) cross.col(i) = OfAnchor(pair, block.hessian.col(i));
    for (int i = 0; i < 6; ++i) anchor.col(i) = OfAnchor(pair, cross.row(i).transpose());
    system_.Hessian(pair.anchor, pair.anchor) += anchor;
    system_.Gradient(pair.anchor) += OfAnchor(pair, block.gradient);
    if (!is_free) return;
    if (pair.pose > pair.anchor)
      system_.Hessian(pair.pose, pair.anchor) += cross.transpose();
    else
      system_.Hessian(pair.anchor, pair.pose) += cross;
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

  // A step of the first image turns the second one back, seen from there. That the error is not
  // small does not matter to the gradient: the inverse left Jacobian leaves its own vector.
  void AddRotation(const RotationPrior& r, const std::vector<Cam>& cams) {
    const Eigen::Vector3d error = RotationError(r, cams);
    const double inverse_sigma = 1 / std::sqrt(r.turn.variance);
    const std::array<int, 2> poses{r.first, r.second};
    const std::array<Eigen::Matrix3d, 2> by_step{
        -inverse_sigma * cams[r.second].rotation * cams[r.first].rotation.transpose(),
        inverse_sigma * Eigen::Matrix3d::Identity()};
    for (int i = 0; i < 2; ++i) {
      if (poses[i] >= problem_.free_poses) continue;
      system_.Gradient(poses[i]).tail<3>() += by_step[i].transpose() * error;
      for (int j = 0; j < 2; ++j)
        if (poses[j] <= poses[i])
          system_.Hessian(poses[i], poses[j]).bottomRightCorner<3, 3>() +=
              by_step[i].transpose() * by_step[j];
    }
  }

  void LinearizePriors(const std::vector<Cam>& cams) {
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    for (const VelocityPrior& v : problem_.velocities) {
      const double first = 1 / (v.first_s * v.sigma), second = 1 / (v.second_s * v.sigma);
      AddCenters<3>(cams, ChangeOfVelocity(v, cams), {v.before, v.middle, v.after},
                    {first * one, -(first + second) * one, second * one});
    }
    for (const RotationPrior& r : problem_.rotations) AddRotation(r, cams);
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
  Pairs pairs_;
  SchurSystem<1> system_;
  std::vector<double> variances_;
};

}  // namespace

double CostOf(const InverseDepthProblem& problem, const InverseDepthState& state,
              std::optional<double> outlier_chi2) {
  Pairs pairs(problem, state.poses.size());
  return Cost(problem, state, outlier_chi2, pairs);
}

void SearchDepths(std::span<const double> candidates, const InverseDepthProblem& problem,
                  InverseDepthState& state) {
  Pairs pairs(problem, state.poses.size());
  pairs.Update(CamsOf(state));
  std::vector<double> costs(candidates.size());
  size_t next = 0;
  for (size_t point = 0; point < problem.points.size(); ++point) {
    std::ranges::fill(costs, 0);
    for (; next < problem.measurements.size() &&
           problem.measurements[next].point == static_cast<int>(point);
         ++next) {
      const DepthMeasurement& s = problem.measurements[next];
      const Pair& pair = pairs[pairs.OfMeasurement(next)];
      for (size_t i = 0; i < candidates.size(); ++i)
        costs[i] +=
            LossOf(pair.Chi2(s, problem.points[point].ray, candidates[i]), problem.huber_chi2).cost;
    }
    state.inverse_depths[point] = candidates[std::ranges::min_element(costs) - costs.begin()];
  }
}

InverseDepthReport MinimizeInverseDepths(const InverseDepthProblem& problem,
                                         const SchurOptions& options, InverseDepthState& state,
                                         bool with_information) {
  InverseDepthReport report;
  if (problem.measurements.empty() || problem.free_poses == 0) return report;
  WindowEquations equations(problem, state.poses.size());
  report.solver = MinimizeLevenbergMarquardt(equations, options.Loop(), state);
  if (with_information) report.information = equations.Information();
  report.variances = equations.TakeVariances();
  return report;
}

}  // namespace oaslam
