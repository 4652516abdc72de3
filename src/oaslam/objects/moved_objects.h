#pragma once

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/life_cycle.h"

namespace oaslam {

// Of an object whose observations contradict its model: if the newer ones agree among themselves,
// it has moved; the older ones are dropped and the model is refitted. False, and nothing changed,
// where they do not.
bool RefitFromNewer(ObjectId id, const ObjectsConfig& config, Map& map);

// Objects that are proven absent from their place (presence.h). One that was detected elsewhere
// meanwhile, as this or as a new object of its class and size, lives on there, under its id and
// name; one that may yet turn out to be waits, unmapped; any other is erased.
void ResolveAbsent(const ImageTime& now, const ObjectsConfig& config, Map& map);

// From now on; objects of classes that move are erased.
void SetClassRelations(ClassRelations classes, Map& map);

}  // namespace oaslam
