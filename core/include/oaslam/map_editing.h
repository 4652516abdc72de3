#pragma once

#include <optional>
#include <string>

#include "oaslam/config.h"
#include "oaslam/export.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/object_edit.h"
#include "oaslam/types.h"

namespace oaslam {

// Functions from maps to maps. The maps that are given do not change.

// The map after a change to one of its objects. `config.objects` tells how an ellipsoid is fitted
// to the boxes of two objects. Throws InputError where the map has no such object, and where two
// objects cannot be one: they are of two classes, or no ellipsoid can be fitted to the boxes of
// both. Whether they are one thing is the judgement of the caller.
OASLAM_API MapSnapshot EditObject(const MapSnapshot& map, ObjectId object, const ObjectEdit& edit,
                                  const SlamConfig& config = SlamConfig::Offline());

// What MergeMaps makes of two maps.
struct MergedMaps {
  std::optional<MapSnapshot> map;  // nothing where the maps could not be merged
  // Text for the user: the evidence for the transformation between the maps, or why the
  // transformation is not known.
  std::string evidence;
};
// Merges two maps that were made apart and partly show the same place:
//
//   const MapSnapshot hall = MapSnapshot::Load("hall.map");
//   const MergedMaps merged =
//       MergeMaps(hall, MapSnapshot::Load("lab.map"));
//   if (merged.map) merged.map->Save("both.map");
//
// Keyframes of each map are looked for in the other one, by the evidence that `mode` allows; their
// poses in both maps determine the transformation. The result has the frame and the ids of `first`.
// Its unit is the metre where one of the maps has the metre, else that of `first`. It takes seconds
// for two rooms. Throws InputError where the maps name a class differently.
OASLAM_API MergedMaps MergeMaps(const MapSnapshot& first, const MapSnapshot& second,
                                RelocalizationMode mode = RelocalizationMode::kPointsAndObjects,
                                const SlamConfig& config = SlamConfig::Offline());

}  // namespace oaslam
