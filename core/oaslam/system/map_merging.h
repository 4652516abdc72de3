#pragma once

#include <optional>
#include <string>

#include "oaslam/config.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/system/submap_link.h"
#include "oaslam/types.h"

namespace oaslam {

// The result of joining two maps that were made apart.
struct MapMerging {
  std::optional<SavedMap> merged;  // nothing where the maps could not be joined
  // For the user: the evidence for the transformation between the maps, or why it is not known.
  std::string evidence;
};

// Joins two maps that were made apart and partly show the same place. Keyframes of each are looked
// for in the other, by points, objects or both; their poses in both determine the transformation.
// Landmarks and objects that both contain are merged, and everything is optimised together. The
// frame and the ids are those of `a`; the unit is the metre where either map has it, else that of
// `a`. Cameras, anchors, class names and trajectories of both are kept; the frames of `b` are
// numbered after those of `a`. Other submaps of either map stay apart. Throws InputError where the
// maps name a class differently.
MapMerging MergeMaps(const SavedMap& a, const SavedMap& b, RelocalizationMode mode,
                     const SlamConfig& config);

}  // namespace oaslam
