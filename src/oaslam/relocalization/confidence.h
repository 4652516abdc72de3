#pragma once

#include "oaslam/relocalization/by_objects.h"

namespace oaslam {

// How often a best hypothesis with this evidence is right, in [0, 1]: not of another place or of
// the wrong side of the desk (within 0.5 m and 30 deg on table tops seen from 1 to 3 m; how
// accurate a right pose is, its sigma tells). Logistic curves fitted by tools/acceptance to a part
// of the data at hand, where one question in six is asked of a wrong map. How right they are on
// each sequence, also on those they were not fitted to: docs/lab/relocalization.md.
double ConfidenceOf(const ObjectPoseCandidate& best);
double ConfidenceOfPoints(int inliers);

// The confidence of a pose that points and objects found independently.
double ConfidenceOfBoth(double by_points, double by_objects);

}  // namespace oaslam
