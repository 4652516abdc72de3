#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <optional>

namespace oaslam {

// The normal equations of a robust least-squares problem with N parameters at a state: J^T W J,
// J^T W r, and the cost, the sum of kernel(r^2).
template <int N>
struct NormalEquations {
  Eigen::Matrix<double, N, N> hessian = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> gradient = Eigen::Matrix<double, N, 1>::Zero();
  double cost = 0;
};

struct LevenbergMarquardtOptions {
  int max_iterations = 20;
  double damping = 1e-4;    // at the start, relative to the diagonal
  double raise = 10;        // of the damping, where a step makes the cost larger
  double least_raised = 0;  // damping after that, at least
  double tolerance = 1e-4;  // ends where the cost falls by less than this share
};

// Minimises by Levenberg-Marquardt: small dense problems whose derivatives cost hardly more than
// their residuals. `linearize(state)` gives NormalEquations<N>; `moved(state, step)` an optional
// state, nothing where a step is too long. Improves `state`, and returns the equations there.
template <int N, typename State, typename Linearize, typename Move>
NormalEquations<N> MinimizeLevenbergMarquardt(const LevenbergMarquardtOptions& options,
                                              State& state, Linearize&& linearize, Move&& moved) {
  // Damping by a million times the diagonal is a step of nothing: there is no better state nearby.
  // The floor is for parameters without any derivative.
  constexpr double kShrink = 0.1, kMaxDamping = 1e6, kFloor = 1e-12;
  NormalEquations<N> here = linearize(state);
  double damping = options.damping;
  for (int i = 0; i < options.max_iterations && damping <= kMaxDamping; ++i) {
    Eigen::Matrix<double, N, N> damped = here.hessian;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += kFloor;
    const Eigen::Matrix<double, N, 1> step = damped.ldlt().solve(-here.gradient);
    if (!step.allFinite()) break;
    const std::optional<State> next = moved(state, step);
    const NormalEquations<N> there = next ? linearize(*next) : here;
    if (!next || !(there.cost <= here.cost)) {
      damping = std::max(damping * options.raise, options.least_raised);
      continue;
    }
    const bool converged = here.cost - there.cost < options.tolerance * here.cost;
    state = *next;
    here = there;
    damping *= kShrink;
    if (converged) break;
  }
  return here;
}

// The covariance of the parameters where the residuals have unit variance; nothing where the
// problem does not determine all of them.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> CovarianceOf(const NormalEquations<N>& equations) {
  constexpr double kLeastPivot = 1e-12;  // relative to the largest: above the errors of rounding
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> factor(equations.hessian);
  if (factor.info() != Eigen::Success ||
      !(factor.vectorD().minCoeff() > kLeastPivot * factor.vectorD().maxCoeff()))
    return std::nullopt;
  return factor.solve(Eigen::Matrix<double, N, N>::Identity());
}

}  // namespace oaslam
