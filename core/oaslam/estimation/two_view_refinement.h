#pragma once

#include "oaslam/estimation/two_view_models.h"

namespace oaslam {

struct RefinedMotion {
  Rigid3 second_from_first;  // translation of length 1
  // Standard deviation of the direction of translation, where it is least certain.
  double direction_sigma_deg = 0;
};

// Refines rotation and direction of translation: minimises the sum over all matches of squared
// Sampson distances, divided by their variances, with Cauchy's kernel.
RefinedMotion RefineMotion(const RayMatches& matches, const Rigid3& start);

// Squared Sampson distance of a match to an essential matrix, px^2 (Hartley & Zisserman, 11.9,
// weighted by the focal lengths).
double SquaredSampson(const RayMatches& matches, const Eigen::Matrix3d& essential, int i);

// [t]x R.
Eigen::Matrix3d EssentialOf(const Rigid3& second_from_first);

}  // namespace oaslam
