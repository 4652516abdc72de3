#include "oaslam/tracking/local_map.h"

#include <algorithm>

#include "oaslam/util/id_set.h"

namespace oaslam {

LocalMap CollectLocalMap(const Map& map, std::span<const LandmarkId> matched, int max_keyframes) {
  std::vector<KeyframeId> observers;
  for (const LandmarkId id : matched)
    if (const Landmark* landmark = map.landmarks.Find(id))
      for (const Observation& o : landmark->observations) observers.push_back(o.keyframe);
  std::ranges::sort(observers);
  std::vector<Covisible> votes;
  for (const KeyframeId id : observers) {
    if (votes.empty() || votes.back().keyframe != id) votes.push_back({id, 0});
    ++votes.back().shared;
  }
  std::ranges::stable_sort(
      votes, [](const Covisible& a, const Covisible& b) { return a.shared > b.shared; });

  LocalMap local;
  const auto add = [&](KeyframeId id) {
    if (static_cast<int>(local.keyframes.size()) < max_keyframes &&
        std::ranges::find(local.keyframes, id) == local.keyframes.end())
      local.keyframes.push_back(id);
  };
  for (const Covisible& vote : votes) add(vote.keyframe);
  const size_t direct = local.keyframes.size();
  for (size_t i = 0; i < direct && static_cast<int>(local.keyframes.size()) < max_keyframes; ++i)
    // Five each: the voting keyframes already have most of the landmarks in view.
    for (const KeyframeId neighbour : map.CovisibleKeyframes(local.keyframes[i], 5)) add(neighbour);

  IdSet<LandmarkId> listed;
  for (const KeyframeId id : local.keyframes)
    for (const LandmarkId landmark : map.keyframes.At(id).landmarks)
      if (landmark.IsValid() && listed.Insert(landmark)) local.landmarks.push_back(landmark);
  return local;
}

}  // namespace oaslam
