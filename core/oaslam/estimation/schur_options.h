#pragma once

#include <stop_token>

#include "oaslam/estimation/levenberg_marquardt.h"

namespace oaslam {

struct SchurOptions {
  int max_iterations = 10;
  // The solver ends after a step that lowers the cost by less than this share.
  double tolerance = 1e-3;
  double huber_chi2 = 0;  // threshold of Huber's kernel on the squared error; 0: no kernel
  std::stop_token stop{};
  double damping = 1e-4;  // at the start, relative to the diagonal of the normal equations

  LevenbergMarquardtOptions Loop() const {
    return {.max_iterations = max_iterations,
            .tolerance = tolerance,
            .damping = damping,
            .lower = 5,
            .least = 1e-9,
            .stop = stop};
  }
};

}  // namespace oaslam
