#include "oaslam/odometry/inverse_depth_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "oaslam/estimation/huber.h"
#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/geometry/skew.h"
#include "oaslam/odometry/inverse_depth_kernels.h"
#include "oaslam/odometry/prior_residuals.h"
#include "oaslam/odometry/sightings_by_pair.h"

namespace oaslam {

struct InverseDepthSolver::Memory {
  struct Depth {
    double hessian, gradient;
    double inverse;    // of the hessian, damped
    size_t cross_end;  // one past its cross blocks
  };

  SightingsByPair sightings;
  std::vector<double> costs;         // of the sightings, by row
  std::vector<SightingTerms> terms;  // the same
  std::vector<PairTerms> sums;
  PoseBlocks hessian, reduced;  // of the poses: the lower half; and without the depths
  // The inertial unknowns: by themselves, and by the poses.
  InertialMatrix inertial;
  Eigen::Matrix<double, 7, Eigen::Dynamic> inertial_by_poses;
  Eigen::VectorXd gradient, right;
  std::vector<Depth> depths;
  std::vector<DepthCross> cross;
  Eigen::MatrixXd system;
};

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

// The normal equations of the poses and the inverse depths, which are eliminated by their Schur
// complement (Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000).
class WindowEquations {
 public:
  WindowEquations(const InverseDepthProblem& problem, size_t poses,
                  InverseDepthSolver::Memory& memory)
      : problem_(problem), m_(memory) {
    m_.sightings.Set(problem, poses, false);
    m_.hessian.Resize(problem.free_poses);
    inertial_at_ = 6 * problem.free_poses;
    m_.gradient.setZero(inertial_at_ + (problem.inertial ? InertialVector::RowsAtCompileTime : 0));
    m_.depths.clear();
    m_.cross.clear();
  }

  double Cost(const InverseDepthState& state) {
    return CostOf(problem_, state, std::nullopt, m_.sightings, m_.costs);
  }

  // Of the state whose cost was asked for last.
  void Linearize(const InverseDepthState& state) {
    m_.hessian.Resize(problem_.free_poses);
    m_.gradient.setZero();
    LinearizePoints(state);
    LinearizePriors(CamsOf(state));
    if (problem_.inertial) LinearizeInertial(*problem_.inertial, state);
  }

  bool Step(double damping, InverseDepthState& state) {
    // Factorises m_.system in place. Its upper half is neither set nor read.
    const auto solution = SolvePositive(Reduced(damping), m_.right);
    if (!solution || !solution->allFinite()) return false;
    const Eigen::VectorXd& step = *solution;
    size_t first = 0;
    for (size_t i = 0; i < m_.depths.size(); ++i) {
      const auto& d = m_.depths[i];
      double back = -d.gradient;
      for (; first < d.cross_end; ++first)
        back -= Block(m_.cross[first]).dot(step.segment<6>(6 * m_.cross[first].pose));
      state.inverse_depths[i] =
          std::max(problem_.least_inverse_depth, state.inverse_depths[i] + d.inverse * back);
    }
    for (int k = 0; k < problem_.free_poses; ++k)
      state.poses[k] = Moved(state.poses[k], PoseVector(step.segment<6>(6 * k)));
    if (problem_.inertial) state.inertial += step.tail<7>();
    return true;
  }

  // The information on the poses, the depths being unknown: the whole Schur complement.
  Eigen::MatrixXd Information() { return Reduced(0, false).selfadjointView<Eigen::Lower>(); }

  ScaleInView Scale(const InverseDepthState& state) const {
    // Information on the logarithm of a depth: of one that is known to a third, and of one known to
    // a twentieth, which counts as much as any: no point is all that counts.
    constexpr double kLeast = 10, kMost = 400;
    const int last = problem_.free_poses - 1;
    ScaleInView scale{Eigen::VectorXd::Zero(m_.gradient.size())};
    double sum = 0;
    size_t measurement = 0, cross = 0;
    for (size_t i = 0; i < m_.depths.size(); ++i) {
      const InverseDepthSolver::Memory::Depth& d = m_.depths[i];
      bool is_seen = false;
      for (; measurement < problem_.measurements.size() &&
             problem_.measurements[measurement].point == static_cast<int>(i);
           ++measurement)
        is_seen = is_seen || (problem_.measurements[measurement].pose == last &&
                              !problem_.measurements[measurement].is_outlier);
      const size_t first = std::exchange(cross, d.cross_end);
      const double rho = state.inverse_depths[i], information = rho * rho * d.hessian;
      if (!is_seen || rho <= 0 || information < kLeast) continue;
      const double weight = std::min(kMost, information);
      sum += weight;
      scale.variance += weight * weight / information;
      for (size_t k = first; k < d.cross_end; ++k)
        scale.by_poses.segment<6>(6 * m_.cross[k].pose) -=
            weight / (rho * d.hessian) * Block(m_.cross[k]);
    }
    if (sum <= 0) return {Eigen::VectorXd::Zero(m_.gradient.size()), 1};  // anything
    scale.by_poses /= sum;
    scale.variance /= sum * sum;
    return scale;
  }

  std::vector<double> Variances() const {
    std::vector<double> variances;
    for (const auto& d : m_.depths) variances.push_back(1 / d.hessian);
    return variances;
  }

 private:
  using Block6 = Eigen::Map<Eigen::Matrix<double, 6, 6>>;

  static Eigen::Map<const Vector6> Block(const DepthCross& cross) {
    return Eigen::Map<const Vector6>(cross.block.data());
  }
  Block6 Hessian(int row, int column) { return Block6(m_.hessian.At(row, column)); }
  auto Gradient(int pose) { return m_.gradient.segment<6>(6 * pose); }

  // The equations of the poses with their diagonal multiplied by 1 + damping, the lower half, and
  // in m_.right their right side.
  Eigen::MatrixXd& Reduced(double damping, bool with_ridge = true) {
    // For a pose or a depth without observations. A share of the largest element, since the unit of
    // length is arbitrary; far below what observations determine.
    constexpr double kRidge = 1e-12;
    PoseBlocks& blocks = m_.reduced;
    blocks = m_.hessian;
    m_.right = -m_.gradient;
    if (with_ridge)
      for (int k = 0; k < problem_.free_poses; ++k) {
        auto diagonal = Block6(blocks.At(k, k)).diagonal();
        const double largest = diagonal.maxCoeff();
        diagonal *= 1 + damping;
        diagonal.array() += kRidge * (1 + largest);
      }
    size_t first = 0;
    for (auto& d : m_.depths) {
      const double damped = d.hessian * (1 + damping);
      d.inverse = 1 / (damped + kRidge * (1 + damped));
      const auto cross = std::span(m_.cross).subspan(first, d.cross_end - first);
      for (const DepthCross& c : cross)
        m_.right.segment<6>(6 * c.pose) += Block(c) * d.inverse * d.gradient;
      EliminateDepth(cross, d.inverse, blocks);
      first = d.cross_end;
    }
    m_.system.resize(m_.gradient.size(), m_.gradient.size());
    for (int row = 0; row < problem_.free_poses; ++row)
      for (int column = 0; column <= row; ++column)
        m_.system.block<6, 6>(6 * row, 6 * column) = Block6(blocks.At(row, column));
    if (problem_.inertial) {
      m_.system.bottomLeftCorner(7, inertial_at_) = m_.inertial_by_poses;
      m_.system.bottomRightCorner<7, 7>() = m_.inertial;
      if (with_ridge) m_.system.bottomRightCorner<7, 7>().diagonal() *= 1 + damping;
    }
    return m_.system;
  }

  // Adds to the last point's cross blocks, which begin at `first`.
  void AddCross(size_t first, int pose, const std::array<double, 6>& block) {
    for (size_t i = first; i < m_.cross.size(); ++i)
      if (m_.cross[i].pose == pose) {
        for (int k = 0; k < 6; ++k) m_.cross[i].block[k] += block[k];
        return;
      }
    m_.cross.push_back({block, pose});
  }

  void LinearizePoints(const InverseDepthState& state) {
    m_.terms.resize(m_.sightings.rows());
    m_.sums.resize(m_.sightings.pairs().size());
    LinearizeSightings(m_.sightings.pairs(), m_.sightings.table(), problem_.corner_chi2,
                       m_.terms.data(), m_.sums.data());
    m_.depths.clear();
    m_.cross.clear();
    size_t next = 0;
    for (size_t point = 0; point < problem_.points.size(); ++point) {
      const DepthPrior& p = problem_.points[point];
      const bool anchor_free = p.anchor < problem_.free_poses;
      double hessian = WeightOf(p, state.inverse_depths[point]) / (p.sigma * p.sigma),
             gradient = (state.inverse_depths[point] - p.inverse_depth) * hessian;
      const size_t first = m_.cross.size();
      for (; next < problem_.measurements.size() &&
             problem_.measurements[next].point == static_cast<int>(point);
           ++next) {
        const DepthMeasurement& m = problem_.measurements[next];
        if (m.is_outlier) continue;
        const SightingTerms& terms = m_.terms[m_.sightings.RowOf(next)];
        hessian += terms.hessian;
        gradient += terms.gradient;
        if (m.pose < problem_.free_poses) AddCross(first, m.pose, terms.by_image);
        if (anchor_free) AddCross(first, p.anchor, terms.by_anchor);
      }
      m_.depths.push_back({hessian, gradient, 0, m_.cross.size()});
    }
    for (size_t i = 0; i < m_.sums.size(); ++i)
      AddPair(m_.sightings.ImagesOf(i), m_.sightings.pairs()[i], m_.sums[i]);
  }

  // From a derivative by the step of the image, that by the step of the anchor, as in
  // inverse_depth_kernels.
  static Vector6 OfAnchor(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                          const Vector6& by_image) {
    const Eigen::Vector3d v = by_image.head<3>(), w = by_image.tail<3>();
    Vector6 by_anchor;
    by_anchor << -(rotation.transpose() * v), rotation.transpose() * (translation.cross(v) - w);
    return by_anchor;
  }

  void AddPair(const SightingsByPair::Images& of, const ImagePair& pair, PairTerms& sum) {
    const bool is_free = of.pose < problem_.free_poses,
               anchor_free = of.anchor < problem_.free_poses;
    const Block6 by_image(sum.hessian.data());
    const Eigen::Map<const Vector6> gradient(sum.gradient.data());
    if (is_free) {
      Hessian(of.pose, of.pose) += by_image;
      Gradient(of.pose) += gradient;
    }
    if (!anchor_free) return;
    const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix3d>(pair.rotation.data());
    const Eigen::Vector3d translation = Eigen::Map<const Eigen::Vector3d>(pair.translation.data());
    Eigen::Matrix<double, 6, 6> cross, anchor;  // anchor by image, anchor by anchor
    for (int i = 0; i < 6; ++i) cross.col(i) = OfAnchor(rotation, translation, by_image.col(i));
    for (int i = 0; i < 6; ++i)
      anchor.col(i) = OfAnchor(rotation, translation, cross.row(i).transpose());
    Hessian(of.anchor, of.anchor) += anchor;
    Gradient(of.anchor) += OfAnchor(rotation, translation, gradient);
    if (!is_free) return;
    if (of.pose > of.anchor)
      Hessian(of.pose, of.anchor) += cross.transpose();
    else
      Hessian(of.anchor, of.pose) += cross;
  }

  // Adds a residual of the camera centres, each of which moves by -R^T v under a step v.
  template <int N>
  void AddCenters(const std::vector<CamMatrices>& cams, const Eigen::Vector3d& residual,
                  const std::array<int, N>& poses,
                  const std::array<Eigen::Matrix3d, N>& by_center) {
    for (int i = 0; i < N; ++i) {
      if (poses[i] >= problem_.free_poses) continue;
      const Eigen::Matrix3d by_i = -by_center[i] * cams[poses[i]].rotation.transpose();
      Gradient(poses[i]).template head<3>() += by_i.transpose() * residual;
      for (int j = 0; j < N; ++j) {
        if (poses[j] > poses[i]) continue;  // both orders come by
        const Eigen::Matrix3d by_j = -by_center[j] * cams[poses[j]].rotation.transpose();
        Hessian(poses[i], poses[j]).template topLeftCorner<3, 3>() += by_i.transpose() * by_j;
      }
    }
  }

  // A step of the first image turns the second one back, seen from there. That the error is not
  // small does not matter to the gradient: the inverse left Jacobian leaves its own vector.
  void AddRotation(const RotationPrior& r, const std::vector<CamMatrices>& cams) {
    const Eigen::Vector3d error = RotationError(r, cams);
    const double inverse_sigma = 1 / std::sqrt(r.turn.variance);
    AddTurns<2>(error, {r.first, r.second},
                {-inverse_sigma * cams[r.second].rotation * cams[r.first].rotation.transpose(),
                 inverse_sigma * Eigen::Matrix3d::Identity()});
  }

  // The derivatives of the logarithm of a rotation by steps from the left and from the right are
  // the inverse Jacobians of SO(3) (Barfoot 2017, 7.1.5).
  void AddTurnRate(const TurnRatePrior& t, const std::vector<CamMatrices>& cams) {
    const Eigen::Vector3d change = ChangeOfTurnRate(t, cams);
    const double root = std::sqrt(LossOf(change.squaredNorm(), problem_.huber_chi2).weight);
    const double first = root / (t.first_s * t.sigma), second = root / (t.second_s * t.sigma);
    const Eigen::Matrix3d before = InverseLeftJacobian(TurnVector(cams[t.before], cams[t.middle])),
                          after = InverseLeftJacobian(TurnVector(cams[t.middle], cams[t.after]));
    AddTurns<3>(root * change, {t.before, t.middle, t.after},
                {first * before.transpose(), -(first * before + second * after.transpose()),
                 second * after});
  }

  static Eigen::Matrix3d InverseLeftJacobian(const Eigen::Vector3d& turn) {
    const double angle = turn.norm();
    const Eigen::Matrix3d cross = Skew(turn);
    // The series of the factor below begins with 1/12.
    const double factor =
        angle < 1e-3 ? 1.0 / 12 : (1 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
    return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
  }

  // Adds a residual of rotations, by the steps of each pose.
  template <int N>
  void AddTurns(const Eigen::Vector3d& residual, const std::array<int, N>& poses,
                const std::array<Eigen::Matrix3d, N>& by_step) {
    for (int i = 0; i < N; ++i) {
      if (poses[i] >= problem_.free_poses) continue;
      Gradient(poses[i]).template tail<3>() += by_step[i].transpose() * residual;
      for (int j = 0; j < N; ++j)
        if (poses[j] <= poses[i])
          Hessian(poses[i], poses[j]).template bottomRightCorner<3, 3>() +=
              by_step[i].transpose() * by_step[j];
    }
  }

  void LinearizePriors(const std::vector<CamMatrices>& cams) {
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    for (const VelocityPrior& v : problem_.velocities) {
      const double first = 1 / (v.first_s * v.sigma), second = 1 / (v.second_s * v.sigma);
      AddCenters<3>(cams, ChangeOfVelocity(v, cams), {v.before, v.middle, v.after},
                    {first * one, -(first + second) * one, second * one});
    }
    for (const TurnRatePrior& t : problem_.turn_rates) AddTurnRate(t, cams);
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

  void LinearizeInertial(const InertialProblem& problem, const InverseDepthState& state) {
    auto gradient = m_.gradient.tail<7>();
    m_.inertial_by_poses.setZero(7, inertial_at_);
    m_.inertial = problem.prior.information;
    gradient = problem.prior.information * state.inertial - problem.prior.right;
    const InertialVector derivative = GravityDerivative(state.inertial);
    m_.inertial += derivative * derivative.transpose();
    gradient += GravityError(state.inertial) * derivative;
    for (const InertialTriple& t : problem.triples) {
      const InertialResidual r = ResidualOf(t, PosesOf(t, state), problem.lever, state.inertial);
      const double weight = LossOf(r.value.squaredNorm(), problem_.huber_chi2).weight;
      m_.inertial += weight * r.by_inertial.transpose() * r.by_inertial;
      gradient += weight * r.by_inertial.transpose() * r.value;
      const std::array<int, 3> poses{t.before, t.middle, t.after};
      std::array<Eigen::Matrix<double, 3, 6>, 3> by_pose;
      for (size_t i = 0; i < 3; ++i) {
        // The centre moves by -R^T v under a step v.
        by_pose[i] << -r.by_center[i] *
                          state.poses[poses[i]].rotation.conjugate().toRotationMatrix(),
            r.by_rotation[i];
        if (poses[i] >= problem_.free_poses) continue;
        Gradient(poses[i]) += weight * by_pose[i].transpose() * r.value;
        m_.inertial_by_poses.middleCols<6>(6 * poses[i]) +=
            weight * r.by_inertial.transpose() * by_pose[i];
      }
      for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
          if (poses[i] < problem_.free_poses && poses[j] <= poses[i])
            Hessian(poses[i], poses[j]) += weight * by_pose[i].transpose() * by_pose[j];
    }
  }

  const InverseDepthProblem& problem_;
  InverseDepthSolver::Memory& m_;
  Eigen::Index inertial_at_ = 0;  // in the system: after the poses
};

}  // namespace

InverseDepthSolver::InverseDepthSolver() : memory_(std::make_unique<Memory>()) {}
InverseDepthSolver::~InverseDepthSolver() = default;

InverseDepthReport InverseDepthSolver::Minimize(const InverseDepthProblem& problem,
                                                const SchurOptions& options,
                                                InverseDepthState& state, bool with_information) {
  InverseDepthReport report;
  if (problem.measurements.empty() || problem.free_poses == 0) return report;
  WindowEquations equations(problem, state.poses.size(), *memory_);
  report.solver = MinimizeLevenbergMarquardt(equations, options.Loop(), state);
  if (with_information) {
    report.information = equations.Information();
    report.scale = equations.Scale(state);
  }
  report.variances = equations.Variances();
  return report;
}

}  // namespace oaslam
