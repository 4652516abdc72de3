#pragma once

#include "oaslam/relocalization/by_objects.h"

namespace oaslam {

// The probability that the best hypothesis with this evidence is right, in [0, 1]. Right means the
// correct place and side of the scene (within 0.5 m and 30 degrees on table tops seen from 1 to 3
// m); the accuracy of a right pose is told by its sigma. Logistic curves fitted by
// tools/acceptance to data in which one question in six is asked of a wrong map; reliability
// diagram in docs/results.md.
double ConfidenceOf(const ObjectPoseCandidate& best);
double ConfidenceOfPoints(int inliers);

// The confidence of a pose that points and objects found independently.
double ConfidenceOfBoth(double by_points, double by_objects);

}  // namespace oaslam
