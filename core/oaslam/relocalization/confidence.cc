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

double ConfidenceOfObjectsAlone(const ObjectSupport& best) {
  if (best.matched.empty() || best.score <= 0) return 0;
  constexpr double kOfRival = 3, kLookAlike = 8.7;
  const double each = best.score / static_cast<double>(best.matched.size()),
               without_rival = std::min(1.0, best.margin / best.score);
  const double is_this_room = Logistic(1.5 * (each + kOfRival * without_rival - kLookAlike));
  constexpr double kRight = 0.25;  // of the distance: 0.5 m from 2 m
  const double is_near = std::erf(kRight / (best.relative_sigma * std::sqrt(2.0)));
  return std::min({ConfidenceOfObjects(best), is_this_room, is_near});
}

double ConfidenceOfBoth(double by_points, double by_objects) {
  return 1 - (1 - by_points) * (1 - by_objects);
}

}  // namespace oaslam
