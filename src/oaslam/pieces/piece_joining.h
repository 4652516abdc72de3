#pragma once

#include "oaslam/config.h"
#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Loops that are closed between two pieces that were joined.
struct PieceTies {
  int most = 3;
  bool are_spread = false;  // over the whole piece, else from its first keyframe on
};

// Adds another piece to a map (JoinMap; the two share no ids), merges objects that both contain,
// and closes loops between keyframes of both where they see the same place. A global bundle
// adjustment should follow where this returns true: then landmarks are shared between the pieces.
bool JoinPiece(const Map& other, const Similarity& world_from_other, const SlamConfig& config,
               Rng& rng, Map& map, const PieceTies& ties = {});

// A bundle adjustment of all of a map that no session works on; objects follow.
void OptimizePiece(const SlamConfig& config, Map& map);

}  // namespace oaslam
