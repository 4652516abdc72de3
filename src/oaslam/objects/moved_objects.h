#pragma once

#include <set>

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/life_cycle.h"

namespace oaslam {

// For an object whose observations contradict its model: if the newer ones agree among themselves,
// the object has moved; the older ones are dropped and the model is fitted again. Returns false and
// changes nothing where they do not agree.
bool RefitFromNewer(ObjectId id, const ObjectsConfig& config, Map& map);

// Handles objects that are proven absent from their places (presence.h). An object that was
// detected elsewhere meanwhile, under its own id or as a new object of its class and size,
// continues there with its id and name. Where it is not decided yet whether a new object is the
// same one, the absent object is kept, unmapped. All others are erased.
//
// An object of an earlier day continues as a new one on less than proof, if the new one's place was
// empty on the earlier day. `shown`: the objects that the images since the last call show, or miss.
void ResolveAbsent(const std::set<ObjectId>& shown, const ImageTime& now,
                   const ObjectsConfig& config, Map& map);

// Sets the class relations and erases objects of classes that move.
void SetClassRelations(ClassRelations classes, Map& map);

}  // namespace oaslam
