#include "oaslam/system/piece_joining.h"

#include <fmt/format.h>

#include <set>
#include <utility>
#include <vector>

#include "oaslam/map/joining.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/objects/object_merging.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// The pose graph holds the map's first keyframe: what moves to the other piece is the one without it.
bool Tie(const std::vector<KeyframeId>& of_map, const std::vector<KeyframeId>& of_other, const SlamConfig& config, Rng& rng, Map& map) {
  constexpr int kMaxTies = 3;
  if (of_map.empty() || of_other.empty()) return false;
  const bool other_is_first = of_other.front() < of_map.front();
  const std::vector<KeyframeId>&moving = other_is_first ? of_map : of_other, &held = other_is_first ? of_other : of_map;
  int ties = 0;
  std::set<KeyframeId> untied(held.begin(), held.end());
  for (const KeyframeId id : moving) {
    const auto tie = FindTie(map, id, untied, rng);
    if (!tie) continue;
    const Eigen::Vector3d center = map.keyframes.At(id).cam_from_world.OriginInSource();
    Log(LogLevel::kDebug, fmt::format("pieces tied at keyframes {} and {}: {} landmarks, off by {:.3f} of the depth, scale {:.3f}", id.value, tie->old.value, tie->old_landmarks.size(),
                                      (tie->old_from_current * center - center).norm() / map.MedianDepth(id), tie->old_from_current.scale));
    if (!CorrectLoop(*tie, config.mapping.min_shared_landmarks, map)) continue;
    if (++ties == kMaxTies) break;
    untied.erase(tie->old);
    for (const Covisible& c : map.keyframes.At(tie->old).covisible) untied.erase(c.keyframe);
  }
  return ties > 0;
}

}  // namespace

bool JoinPiece(const Map& other, const Similarity& world_from_other, const SlamConfig& config, Rng& rng, Map& map) {
  const std::vector<KeyframeId> before = map.keyframes.Ids(), joined = other.keyframes.Ids();
  JoinMap(other, world_from_other, map);
  const std::vector<ObjectId> objects = other.objects.Ids();
  MergeDuplicates(map, std::set<ObjectId>(objects.begin(), objects.end()), config.objects);
  return Tie(before, joined, config, rng, map);
}

}  // namespace oaslam
