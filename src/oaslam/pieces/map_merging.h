#pragma once

#include <optional>
#include <string>

#include "oaslam/config.h"
#include "oaslam/pieces/piece_link.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/types.h"

namespace oaslam {

// The result of joining two maps that were made apart.
struct MapMerging {
  std::optional<SavedMap> merged;  // nothing where the maps could not be joined
  // For the user: the evidence for how one map lies to the other; or why that is not known.
  std::string evidence;
};

// Joins two maps made apart, of which a part shows the same place: keyframes of each are looked for
// in the other, by points, objects or both, and their poses in both tell how the maps lie to each
// other. Landmarks and objects that both contain are merged and everything is optimised together.
// The frame, and the numbers, are those of `a`; the unit is the metre where either map has it, else
// that of `a`. Cameras, anchors, class names and trajectories of both are kept; frames of `b` count
// from behind those of `a`. Pieces of either that could not be joined before stay apart. Throws
// InputError where both maps name a class differently.
MapMerging MergeMaps(const SavedMap& a, const SavedMap& b, RelocalizationMode mode,
                     const SlamConfig& config);

}  // namespace oaslam
