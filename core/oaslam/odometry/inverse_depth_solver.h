#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "oaslam/estimation/schur_options.h"
#include "oaslam/odometry/inverse_depth_problem.h"

namespace oaslam {

// The scale of what the last free pose sees, as it depends on the poses: the mean logarithm of the
// inverse depths of its points, weighted by how well they are known.
struct ScaleInView {
  Eigen::VectorXd by_poses;  // its derivative by what `information` is of
  double variance = 0;       // of the mean, given the poses; 1 without any depth
};

struct InverseDepthReport {
  MinimizationReport solver;
  std::vector<double> variances;  // of each inverse depth, given the poses
  // The information matrix of the free poses, with the points eliminated: the normal equations at
  // the last linearisation, in the order of PoseVector, and then the inertial unknowns, if there
  // are such. Empty without `with_information`.
  Eigen::MatrixXd information;
  ScaleInView scale;  // only with `with_information`
};

// Levenberg-Marquardt on the Schur complement of the inverse depths. Huber's threshold is that of
// the problem. Each call reuses the memory of the one before.
class InverseDepthSolver {
 public:
  InverseDepthSolver();
  ~InverseDepthSolver();
  InverseDepthReport Minimize(const InverseDepthProblem& problem, const SchurOptions& options,
                              InverseDepthState& state, bool with_information = false);

  struct Memory;

 private:
  std::unique_ptr<Memory> memory_;
};

}  // namespace oaslam
