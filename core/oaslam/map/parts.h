#pragma once

#include <optional>

#include "oaslam/class_relations.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Whether one object is a part of the other, by class and by position. Such objects hide no edges
// of each other, and where one is detected the other is not expected: detectors see wholes from
// afar and parts from near.
bool BelongTogether(const ClassRelations& classes, int category_a, const Ellipsoid& a,
                    int category_b, const Ellipsoid& b);

// The mapped object that a mapped object is a part of; the smallest where there are several.
std::optional<ObjectId> WholeOf(const Map& map, ObjectId part);

}  // namespace oaslam
