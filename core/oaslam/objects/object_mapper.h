#pragma once

#include <span>

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/association.h"
#include "oaslam/objects/life_cycle.h"

namespace oaslam {

// Updates the objects of the map. Call it once per keyframe, after its local bundle adjustment. It
// adds the sightings since the last call (in the order of their frames; their keyframes must be
// resolvable), refits the objects that were seen and those around the camera whose keyframes have
// moved, decides on their states (life_cycle.h), and merges duplicates. Sets Map::up where the
// cameras determine it (upright.h).
void UpdateObjects(Map& map, std::span<const ObjectSighting> sightings, const ImageTime& now,
                   const ObjectsConfig& config);

// Call it after all keyframes have moved (global bundle adjustment). Refits objects whose
// ellipsoids no longer fit their boxes as before, merges objects that are now the same, and sets
// Map::up. No time passes, so that no object is dropped for not being seen.
void RefitMovedObjects(const ObjectsConfig& config, Map& map);

// Call it once the keyframes have their final poses. Objects through which the keyframes see
// landmarks are moved, unmapped or erased (sight_lines.h, moved_objects.h); keyframes from before
// the camera was found in the map count, too.
void ReviewPlaces(const ObjectsConfig& config, Map& map);

}  // namespace oaslam
