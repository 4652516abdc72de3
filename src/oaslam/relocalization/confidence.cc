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

double ConfidenceOfPoints(const PointSupport& best) {
  constexpr int kFewest = 8;           // three of them fit always
  constexpr double kExpected = 20;     // so that a share of few expected ones does not count much
  constexpr double kExact = 0.02;      // a smaller relative sigma is no better sign
  constexpr double kOfInlier = 0.125;  // few are no more certain than this, whatever their share
  if (best.inliers < kFewest) return 0;
  const double found_share = best.inliers / (best.expected + kExpected);
  const double log_odds = 3.38 + 2.62 * std::log(found_share) +
                          6.11 * std::log(best.covered + 0.05) -
                          3.33 * std::log(std::max(best.relative_sigma, kExact));
  return Logistic(std::min(log_odds, kOfInlier * best.inliers));
}

double ConfidenceOfBoth(double by_points, double by_objects) {
  return 1 - (1 - by_points) * (1 - by_objects);
}

}  // namespace oaslam
