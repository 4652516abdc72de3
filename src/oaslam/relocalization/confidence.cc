#include "oaslam/relocalization/confidence.h"

#include <cmath>

namespace oaslam {
namespace {

double Logistic(double x) { return 1 / (1 + std::exp(-x)); }

}  // namespace

double ConfidenceOf(const ObjectPoseCandidate& best) {
  return Logistic(0.18 * (best.Evidence() - 15));
}

double ConfidenceOfPoints(int inliers) { return Logistic(10 * std::log(inliers / 18.0 + 1e-9)); }

double ConfidenceOfBoth(double by_points, double by_objects) {
  return 1 - (1 - by_points) * (1 - by_objects);
}

}  // namespace oaslam
