#include "oaslam/relocalization/confidence.h"

#include <algorithm>
#include <cmath>

namespace oaslam {
namespace {

double Logistic(double x) { return 1 / (1 + std::exp(-x)); }

}  // namespace

// An object that a wrong pose matches by chance adds about 4 to the score, so that only the score
// beyond that counts. The numbers are fitted by tools/acceptance.
double ConfidenceOfObjects(const ObjectSupport& best) {
  constexpr double kByChance = 3.6, kOfMargin = 0.3;
  const double beyond_chance =
      best.score - kByChance * static_cast<double>(best.matched.size()) + kOfMargin * best.margin;
  return Logistic(0.28 * (beyond_chance - 16));
}

double ConfidenceOfBoth(double by_points, double by_objects) {
  return 1 - (1 - by_points) * (1 - by_objects);
}

}  // namespace oaslam
