#pragma once

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/life_cycle.h"

namespace oaslam {

// For an object whose observations contradict its model. If the newer observations agree with each
// other, the object has moved: drops the older ones and fits the model again. Returns false and
// changes nothing otherwise.
bool RefitFromNewer(ObjectId id, const ObjectsConfig& config, Map& map);

// Handles objects that are proven absent from their places (presence.h). An object that was
// detected elsewhere meanwhile, under its own id or as a new object of its class and size,
// continues there with its id and name. Where it is not decided yet whether a new object is the
// same one, the absent object is kept, unmapped. All others are erased.
void ResolveAbsent(const ImageTime& now, const ObjectsConfig& config, Map& map);

// Sets the class relations and erases objects of classes that move.
void SetClassRelations(ClassRelations classes, Map& map);

}  // namespace oaslam
