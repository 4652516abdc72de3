#include "oaslam/tracking/local_map.h"

#include <algorithm>

namespace oaslam {

LocalMap CollectLocalMap(const Map& map, std::span<const LandmarkId> matched, int max_keyframes) {
  std::vector<Covisible> votes;
  for (const LandmarkId id : matched) {
    const Landmark* landmark = id.IsValid() ? map.landmarks.Find(id) : nullptr;
    if (!landmark) continue;
    for (const Observation& o : landmark->observations) {
      if (votes.size() <= o.keyframe.value) votes.resize(o.keyframe.value + 1);
      votes[o.keyframe.value].keyframe = o.keyframe;
      ++votes[o.keyframe.value].shared;
    }
  }
  std::erase_if(votes, [](const Covisible& v) { return v.shared == 0; });
  std::ranges::stable_sort(
      votes, [](const Covisible& a, const Covisible& b) { return a.shared > b.shared; });

  LocalMap local;
  std::vector<char> taken;
  const auto add = [&](KeyframeId id) {
    if (static_cast<int>(local.keyframes.size()) >= max_keyframes) return;
    if (taken.size() <= id.value) taken.resize(id.value + 1, 0);
    if (taken[id.value]) return;
    taken[id.value] = 1;
    local.keyframes.push_back(id);
  };
  for (const Covisible& vote : votes) add(vote.keyframe);
  const size_t direct = local.keyframes.size();
  for (size_t i = 0; i < direct && static_cast<int>(local.keyframes.size()) < max_keyframes; ++i)
    for (const KeyframeId neighbour : map.CovisibleKeyframes(local.keyframes[i], 5)) add(neighbour);

  std::vector<char> listed(map.next_landmark, 0);
  for (const KeyframeId id : local.keyframes)
    for (const LandmarkId landmark : map.keyframes.At(id).landmarks)
      if (landmark.IsValid() && !listed[landmark.value]) {
        listed[landmark.value] = 1;
        local.landmarks.push_back(landmark);
      }
  return local;
}

}  // namespace oaslam
