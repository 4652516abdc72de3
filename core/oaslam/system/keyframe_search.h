#pragma once

#include <cstddef>

#include "oaslam/config.h"
#include "oaslam/map/submap.h"
#include "oaslam/relocalization/relocalizer.h"
#include "oaslam/system/submap_link.h"

namespace oaslam {

// How many keyframes to look for, spread evenly over the submap where it has more.
struct SearchEffort {
  size_t max_keyframes = 60;
  size_t max_in_vain = 15;  // number of keyframes after which the search ends if none was found
};

struct SearchResult {
  size_t looked_for = 0, found = 0;
  size_t flat = 0;  // found by one plane alone, which does not identify a place (TellsPlace)
};

// Relocalizes keyframes of a submap in another map, and adds the keyframes that were found, except
// the flat ones, to `link`.
SearchResult FindKeyframes(const Submap& submap, const Map& world, RelocalizationMode mode,
                           const SearchEffort& effort, const SlamConfig& config,
                           Relocalizer& relocalizer, SubmapLink& link);

}  // namespace oaslam
