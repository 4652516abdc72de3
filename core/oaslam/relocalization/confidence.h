#pragma once

#include "oaslam/map/relocalization.h"

namespace oaslam {

// Where a pose has at least this confidence, the search for other hypotheses ends.
constexpr double kConfidenceThatEndsSearch = 0.998;

// The probability, in [0, 1], that a best hypothesis with this evidence is right: within 0.5 m and
// 30 degrees of the truth on table tops seen from 1 to 3 m, which excludes another place and the
// wrong side of the desk. (The sigma of a pose tells how accurate a right one is.) Logistic curves
// fitted by tools/acceptance, with one image in six looked for in a wrong map.
// docs/lab/relocalization.md has their error on each sequence, also on those they were not fitted
// to.
double ConfidenceOfObjects(const ObjectSupport& best);

// The probability of ConfidenceOfObjects where the map has points and none agrees with the pose.
// Objects alone must also exclude another room with a similar arrangement (in a hotel, an office),
// in which each box fits less well, or in which another pose fits as well. A sigma of the position
// of an eighth of the distance or more lowers the probability. At most ConfidenceOfObjects. Fitted
// to images of flats and desks in maps of each other (docs/lab/relocalization.md).
double ConfidenceOfObjectsAlone(const ObjectSupport& best);

// The confidence of a pose that points and objects found independently.
double ConfidenceOfBoth(double by_points, double by_objects);

}  // namespace oaslam
