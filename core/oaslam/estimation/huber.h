#pragma once

#include <cmath>

namespace oaslam {

// A point at or behind the camera has no projection: its error is a constant of 141 sigmas instead,
// so that no step gains by moving it there.
inline constexpr double kBehindChi2 = 2e4;

struct Loss {
  double cost, weight;
};

// Huber's loss of a squared residual, and the weight of the residual in iteratively reweighted
// least squares; `huber_chi2`: the square from which on the loss is linear, 0 for none.
inline Loss LossOf(double chi2, double huber_chi2) {
  if (huber_chi2 <= 0 || chi2 <= huber_chi2) return {chi2, 1};
  const double root = std::sqrt(huber_chi2 * chi2);
  return {2 * root - huber_chi2, root / chi2};
}

}  // namespace oaslam
