#include "oaslam/mapping/submap_joining.h"

#include <bit>
#include <set>
#include <vector>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/map/joining.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/objects/object_merging.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Sorts so that any first few are spread over all: first, middle, quarters, eighths...
std::vector<KeyframeId> Spread(const std::vector<KeyframeId>& ids) {
  std::vector<KeyframeId> spread;
  const size_t whole = std::bit_ceil(ids.size());
  for (size_t step = whole; step > 0; step /= 2)
    for (size_t i = 0; i < ids.size(); i += step)
      if (step == whole || i % (2 * step) != 0) spread.push_back(ids[i]);
  return spread;
}

// Closes loops between keyframes of the other submap and of the map. The first keyframe of the map
// stays fixed. Returns whether any loop was closed.
bool Tie(const std::vector<KeyframeId>& of_map, const std::vector<KeyframeId>& of_other,
         const SubmapTies& wanted, Rng& rng, Map& map) {
  int ties = 0;
  std::set<KeyframeId> untied(of_map.begin(), of_map.end());
  for (const KeyframeId id : wanted.are_spread ? Spread(of_other) : of_other) {
    const auto tie = FindTie(map, id, untied, rng);
    if (!tie || !CorrectLoop(*tie, map, of_map.front())) continue;
    ++map.loops_closed;
    Log(LogLevel::kDebug, "submaps tied at keyframes {} and {} by {} landmarks", id.value,
        tie->old.value, tie->old_landmarks.size());
    if (++ties == wanted.most) break;
    untied.erase(tie->old);
    for (const Covisible& c : map.keyframes.At(tie->old).covisible) untied.erase(c.keyframe);
  }
  return ties > 0;
}

}  // namespace

bool JoinSubmap(const Map& other, const Similarity& world_from_other, const SlamConfig& config,
                Rng& rng, Map& map, const SubmapTies& ties) {
  const std::vector<KeyframeId> before = map.keyframes.Ids(), joined = other.keyframes.Ids();
  JoinMap(other, world_from_other, map);
  const std::vector<ObjectId> objects = other.objects.Ids();
  MergeDuplicates(map, std::set<ObjectId>(objects.begin(), objects.end()), config.objects);
  return Tie(before, joined, ties, rng, map);
}

void AdjustAll(const SlamConfig& config, Map& map) {
  // At most: after a loop, and where submaps were joined, the start may be far from the minimum.
  constexpr int kIterations = 20;
  if (map.keyframes.size() <= 2) return;
  for (const std::vector<KeyframeId>& window : AdjustmentWindows(map))
    ApplyCorrection(WindowBundleAdjustment(map, window, kIterations, config.bundle), map);
  RefitMovedObjects(config.objects, map);
}

void OptimizeSubmap(const SlamConfig& config, Map& map) {
  AdjustAll(config, map);
  ++map.version;
}

}  // namespace oaslam
