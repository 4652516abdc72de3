#pragma once

#include <optional>

#include "oaslam/class_relations.h"
#include "oaslam/map/map.h"

namespace oaslam {

// One is a part of the other: by its class, and by its place. What belongs together hides no edge
// of each other, and the one's detection excuses that the other is missed: detectors see wholes
// from afar and parts from near.
bool BelongTogether(const ClassRelations& classes, int category_a, const Ellipsoid& a,
                    int category_b, const Ellipsoid& b);

// The mapped object that a mapped object is a part of; of several the smallest.
std::optional<ObjectId> WholeOf(const Map& map, ObjectId part);

}  // namespace oaslam
