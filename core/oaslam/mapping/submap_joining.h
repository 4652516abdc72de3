#pragma once

#include "oaslam/config.h"
#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// The loops to close between two submaps that were joined.
struct SubmapTies {
  int most = 3;
  bool are_spread = false;  // over the whole submap; else at its first keyframes
};

// Adds another submap to a map (JoinMap; the two share no ids), merges objects that both contain,
// and closes loops between keyframes of both where they see the same place. Returns true where the
// submaps now share landmarks; a global bundle adjustment should follow then.
bool JoinSubmap(const Map& other, const Similarity& world_from_other, const SlamConfig& config,
                Rng& rng, Map& map, const SubmapTies& ties = {});

// Adjusts all of a map, window by window, and refits its objects. A map of at most two keyframes is
// left unchanged.
void AdjustAll(const SlamConfig& config, Map& map);

// Adjusts all of a map on which no session works, and increases its Map::version.
void OptimizeSubmap(const SlamConfig& config, Map& map);

}  // namespace oaslam
