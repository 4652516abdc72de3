#pragma once

#include <array>

namespace oaslam {

struct RealRoots2 {
  std::array<double, 2> roots{};
  int count = 0;
};

// Real roots of a x^2 + b x + c without cancellation; a may be zero.
RealRoots2 SolveQuadratic(double a, double b, double c);

// One real root of a x^3 + b x^2 + c x + d; where there are several, the one with the steepest
// slope. Leading coefficients may be zero, but not all of a, b and c.
double SolveCubicForOneRoot(double a, double b, double c, double d);

}  // namespace oaslam
