#pragma once

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <utility>

namespace oaslam {

struct SchurOptions {
  int max_iterations = 10;
  // The solver ends after a step that lowers the cost by less than this share.
  double tolerance = 1e-3;
  double huber_chi2 = 0;  // threshold of Huber's kernel on the squared error; 0: no kernel
  std::stop_token stop{};
};

struct SchurReport {
  // False: there was nothing to solve, the numbers were not finite, or a stop was requested; the
  // state is then as good as before or better.
  bool success = false;
  int iterations = 0;
  double cost = 0;  // of the state at the end
};

// The Levenberg-Marquardt loop of the solvers by Schur complement. A Solver has Cost(state),
// Linearize(state), and Step(damping, state), which moves a state and says whether it could.
template <typename Solver, typename State>
SchurReport MinimizeBySchur(Solver& solver, const SchurOptions& options, State& state) {
  constexpr double kMaxDamping = 1e6;  // relative to the diagonal: steps of nothing
  SchurReport report;
  double& cost = report.cost;
  cost = solver.Cost(state);
  double damping = 1e-4;
  bool is_new = true, was_solved = false;
  while (report.iterations < options.max_iterations && damping < kMaxDamping) {
    if (options.stop.stop_requested()) return report;
    if (is_new) solver.Linearize(state);
    ++report.iterations;
    State moved = state;
    const bool solved = solver.Step(damping, moved);
    was_solved = was_solved || solved;
    const double new_cost = solved ? solver.Cost(moved) : cost;
    is_new = solved && new_cost < cost;
    if (!is_new) {
      damping *= 10;
      continue;
    }
    const double decrease = cost - new_cost;
    state = std::move(moved);
    damping = std::max(damping / 5, 1e-9);
    const bool is_done = decrease < options.tolerance * cost;
    cost = new_cost;
    if (is_done) break;
  }
  report.success = was_solved && std::isfinite(cost);
  return report;
}

}  // namespace oaslam
