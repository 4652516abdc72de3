#pragma once

#include <set>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Merges each of `changed` with objects of its class that are the same (paper, section "Objects
// Fusion"). Their bounding boxes in space touch or overlap, the centre of one is inside the other,
// or they share landmarks, which is the only criterion for objects without an ellipsoid; and one
// ellipsoid must explain the observations of both. Objects that were detected side by side in the
// same images are never merged. The observations go to the object that is mapped, or else to the
// one with the lower id; the other id stays resolvable.
void MergeDuplicates(Map& map, const std::set<ObjectId>& changed, const ObjectsConfig& config);

// Merges two objects at a user's request: they must be of one class and have a common ellipsoid.
// Returns false and changes nothing otherwise.
bool MergeObjects(Map& map, ObjectId kept, ObjectId gone, const ObjectsConfig& config);

}  // namespace oaslam
