#include "oaslam/geometry/polynomial.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace oaslam {

RealRoots2 SolveQuadratic(double a, double b, double c) {
  const double size = std::max({std::abs(a), std::abs(b), std::abs(c)});
  if (std::abs(a) <= 1e-14 * size) {
    if (std::abs(b) <= 1e-14 * size) return {};
    return {{-c / b, 0}, 1};
  }
  const double discriminant = b * b - 4 * a * c;
  if (discriminant < 0) {
    // A double root that rounding pushed off the axis.
    if (discriminant > -1e-12 * std::max(b * b, std::abs(4 * a * c))) return {{-b / (2 * a), 0}, 1};
    return {};
  }
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  if (q == 0) return {{0, 0}, 1};
  return {{q / a, c / q}, 2};
}

namespace {

double Polished(double b, double c, double d, double x) {
  for (int i = 0; i < 8; ++i) {
    const double value = ((x + b) * x + c) * x + d, slope = (3 * x + 2 * b) * x + c;
    if (slope == 0) break;
    const double step = value / slope;
    x -= step;
    if (std::abs(step) <= 1e-16 * std::abs(x)) break;
  }
  return x;
}

}  // namespace

double SolveCubicForOneRoot(double a, double b, double c, double d) {
  if (std::abs(a) <= 1e-12 * std::max({std::abs(b), std::abs(c), std::abs(d)})) {
    const RealRoots2 quadratic = SolveQuadratic(b, c, d);
    return quadratic.count > 0 ? quadratic.roots[0] : (b != 0 ? -c / (2 * b) : 0.0);
  }
  b /= a;
  c /= a;
  d /= a;
  // Cardano and Vieta on x = t - b/3: t^3 + 3 p t + 2 q.
  const double p = (3 * c - b * b) / 9, q = (2 * b * b * b - 9 * b * c + 27 * d) / 54;
  const double discriminant = q * q + p * p * p;
  if (discriminant >= 0) {
    const double u = -std::copysign(std::cbrt(std::abs(q) + std::sqrt(discriminant)), q);
    return Polished(b, c, d, (u == 0 ? 0.0 : u - p / u) - b / 3);
  }
  const double radius = 2 * std::sqrt(-p),
               angle = std::acos(std::clamp(-q / std::sqrt(-p * p * p), -1.0, 1.0));
  double best = 0, best_slope = -1;
  for (int k = 0; k < 3; ++k) {
    const double x =
        Polished(b, c, d, radius * std::cos((angle + 2 * std::numbers::pi * k) / 3) - b / 3);
    const double slope = std::abs((3 * x + 2 * b) * x + c);
    if (slope > best_slope) {
      best = x;
      best_slope = slope;
    }
  }
  return best;
}

}  // namespace oaslam
