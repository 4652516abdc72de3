#include "oaslam/util/rng.h"

#include <cmath>
#include <numbers>

namespace oaslam {

double Rng::Gaussian(double sigma) {  // Box-Muller
  const double u = 1 - Uniform(0, 1), v = Uniform(0, 1);
  return sigma * std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

}  // namespace oaslam
