#pragma once

#include <span>

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/association.h"
#include "oaslam/objects/life_cycle.h"

namespace oaslam {

// Updates the objects of the map, once per keyframe and after its local bundle adjustment: adds the
// sightings since the last call (in the order of their frames; their keyframes must be resolvable),
// refits the objects that were seen, or that are about the camera and whose keyframes have moved,
// decides on their states
// (life_cycle.h), and merges duplicates. Sets Map::up where the cameras determine it (upright.h).
void UpdateObjects(Map& map, std::span<const ObjectSighting> sightings, const ImageTime& now,
                   const ObjectsConfig& config);

// To be called after all keyframes have moved (global bundle adjustment): fits objects again whose
// ellipsoids no longer fit their boxes as before, merges objects that are now the same, and sets
// Map::up. No time passes, so that no object is dropped for not being seen.
void RefitMovedObjects(const ObjectsConfig& config, Map& map);

// To be called when all keyframes are where they stay: objects that any keyframe looks through are
// moved, set aside or erased (sight_lines.h, moved_objects.h), also where the camera passed before
// it was found in the map.
void ReviewPlaces(const ObjectsConfig& config, Map& map);

}  // namespace oaslam
