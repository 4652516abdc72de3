#pragma once

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What an object's ellipsoid and covariance become when the world around it moves.
void MoveObject(const Similarity& new_from_old, Object& object);

// Adds all of another map of the same cameras, none of whose ids are taken here. Covisibility and
// objects are as they were: what both maps show is still there twice. A name of an anchor that is
// taken gets a number.
void JoinMap(const Map& other, const Similarity& world_from_other, Map& map);

}  // namespace oaslam
