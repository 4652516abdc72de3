#pragma once

#include "oaslam/config.h"
#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Adds all of another piece to a map, none of whose ids are taken there (JoinMap), and makes one of
// what both show: objects, and landmarks where both saw a place. A global bundle adjustment should
// follow; returns whether landmarks tie the pieces for it.
bool JoinPiece(const Map& other, const Similarity& world_from_other, const SlamConfig& config,
               Rng& rng, Map& map);

}  // namespace oaslam
