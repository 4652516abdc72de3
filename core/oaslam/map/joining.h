#pragma once

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Transforms an object's ellipsoid and covariance.
void MoveObject(const Similarity& new_from_old, Object& object);

// Adds the content of another map, which has the same cameras and no id of this one. Nothing is
// merged: landmarks and objects that both maps contain exist twice afterwards. An anchor whose name
// is taken gets a number.
void JoinMap(const Map& other, const Similarity& world_from_other, Map& map);

}  // namespace oaslam
