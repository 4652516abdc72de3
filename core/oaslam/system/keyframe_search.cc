#include "oaslam/system/keyframe_search.h"

#include <cmath>
#include <vector>

#include "oaslam/tracking/continuity.h"
#include "oaslam/util/rng.h"

namespace oaslam {

SearchResult FindKeyframes(const Submap& submap, const Map& world, RelocalizationMode mode,
                           const SearchEffort& effort, const SlamConfig& config,
                           Relocalizer& relocalizer, SubmapLink& link) {
  const std::vector<KeyframeId> ids = submap.map.keyframes.Ids();
  const size_t step = (ids.size() + effort.max_keyframes - 1) / effort.max_keyframes;
  SearchResult result;
  for (size_t i = 0; i < ids.size(); i += step) {
    if (result.found + result.flat == 0 && result.looked_for >= effort.max_in_vain) break;
    const Frame frame = FrameOf(submap.map, ids[i]);
    Rng rng(static_cast<uint64_t>(config.runner.seed));
    const Relocalization found = relocalizer.Find(frame, world, mode, rng);
    ++result.looked_for;
    if (!found.IsFound()) continue;
    if (!TellsPlace(world, submap.map, found, INFINITY)) {
      ++result.flat;
      continue;
    }
    link.AddKeyframe(frame.index, found, world, false);
    ++result.found;
  }
  return result;
}

}  // namespace oaslam
