#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stop_token>
#include <type_traits>
#include <utility>

#include "oaslam/geometry/decompositions.h"

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
  double tolerance = 1e-4;  // ends after a step that lowers the cost by less than this share
  // The damping is relative to the diagonal of the normal equations.
  double damping = 1e-4;     // at the start
  double raise = 10;         // factor, where a step is not taken
  double least_raised = 0;   // damping after that, at least
  double lower = 10;         // divisor, where a step is taken
  double least = 0;          // damping after that, at least
  bool takes_equal = false;  // takes also a step that leaves the cost as it is
  std::stop_token stop{};
};

struct MinimizationReport {
  // False: there was nothing to solve, the numbers were not finite, or a stop was requested; the
  // state is then as good as before or better.
  bool success = false;
  int iterations = 0;
  double cost = 0;  // of the state at the end
  // The iterations ended by the tolerance, or because no step lowers the cost; not by their number
  // or a stop. If it is false, a call that begins with `damping` continues as if there had been
  // more iterations.
  bool is_settled = false;
  double damping = 0;
};

// Minimises by Levenberg-Marquardt. A Problem has Cost(state); Linearize(state), called at the
// start and where a step was taken, with the state whose cost was asked for last; and Step(damping,
// state), which moves a state and says whether it could.
template <typename Problem, typename State>
MinimizationReport MinimizeLevenbergMarquardt(Problem& problem,
                                              const LevenbergMarquardtOptions& options,
                                              State& state) {
  // With a damping of a million times the diagonal a step is next to zero: there is no better state
  // nearby.
  constexpr double kMaxDamping = 1e6;
  MinimizationReport report;
  double &cost = report.cost, &damping = report.damping;
  cost = problem.Cost(state);
  damping = options.damping;
  bool is_new = true, was_solved = false;
  while (report.iterations < options.max_iterations && damping < kMaxDamping) {
    if (options.stop.stop_requested()) return report;
    if (is_new) problem.Linearize(state);
    ++report.iterations;
    State moved = state;
    const bool solved = problem.Step(damping, moved);
    was_solved = was_solved || solved;
    const double new_cost = solved ? problem.Cost(moved) : cost;
    is_new = solved && (options.takes_equal ? new_cost <= cost : new_cost < cost);
    if (!is_new) {
      damping = std::max(damping * options.raise, options.least_raised);
      continue;
    }
    const double decrease = cost - new_cost;
    state = std::move(moved);
    damping = std::max(damping / options.lower, options.least);
    const bool is_done = decrease < options.tolerance * cost;
    cost = new_cost;
    report.is_settled = is_done;
    if (is_done) break;
  }
  report.is_settled = report.is_settled || damping >= kMaxDamping;
  report.success = was_solved && std::isfinite(cost);
  return report;
}

// The same for N parameters whose derivatives cost hardly more than their residuals:
// `linearize(state)` gives NormalEquations<N>; `moved(state, step)` an optional state, nothing
// where a step is too long. Improves `state`, and returns the equations there.
template <int N, typename State, typename EquationsAt, typename Move>
NormalEquations<N> MinimizeDense(LevenbergMarquardtOptions options, State& state,
                                 EquationsAt&& linearize, Move&& moved) {
  struct Problem {
    std::remove_reference_t<EquationsAt>& linearize;
    std::remove_reference_t<Move>& moved;
    NormalEquations<N> here{}, newest{};

    double Cost(const State& at) { return (newest = linearize(at)).cost; }
    void Linearize(const State&) { here = newest; }
    bool Step(double damping, State& from) const {
      constexpr double kFloor = 1e-12;  // for parameters without any derivative
      Eigen::Matrix<double, N, N> damped = here.hessian;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += kFloor;
      const Eigen::Matrix<double, N, 1> step = SolveSymmetric<N>(damped, -here.gradient);
      const std::optional<State> next = step.allFinite() ? moved(from, step) : std::nullopt;
      if (next) from = *next;
      return next.has_value();
    }
  } problem{linearize, moved};
  options.takes_equal = true;
  const double cost = MinimizeLevenbergMarquardt(problem, options, state).cost;
  return problem.newest.cost == cost ? problem.newest : problem.here;
}

// The covariance of the parameters where the residuals have unit variance; nothing where the
// problem does not determine all of them.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> CovarianceOf(const NormalEquations<N>& equations) {
  return InverseOfInformation<N>(equations.hessian);
}

}  // namespace oaslam
