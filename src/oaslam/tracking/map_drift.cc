#include "oaslam/tracking/map_drift.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

namespace oaslam {
namespace {

int SeenBy(const Keyframe& keyframe) {
  return static_cast<int>(
      std::ranges::count_if(keyframe.landmarks, [](LandmarkId id) { return id.IsValid(); }));
}

// The share of landmarks that two keyframes do not share.
double Link(int seen_by_one, int seen_by_other, int shared) {
  const int fewer = std::min(seen_by_one, seen_by_other);
  return fewer > 0 ? std::max(0.0, 1 - shared / static_cast<double>(fewer)) : 1;
}

}  // namespace

double MapDrift::LinksTo(const Map& map, KeyframeId id) {
  if (loops_closed_ != map.loops_closed || links_.empty()) LinkAll(map);
  if (const auto known = links_.find(id); known != links_.end()) return known->second;
  const Keyframe& keyframe = map.keyframes.At(id);
  const int seen = SeenBy(keyframe);
  double least = std::numeric_limits<double>::infinity();
  for (const Covisible& c : keyframe.covisible)
    if (const auto known = links_.find(c.keyframe); known != links_.end())
      least = std::min(least,
                       known->second + Link(seen, SeenBy(map.keyframes.At(c.keyframe)), c.shared));
  if (!std::isfinite(least))
    LinkAll(map);
  else
    links_.emplace(id, least);
  return links_.at(id);
}

// Dijkstra's shortest paths. Keyframes that follow each other are linked where they share nothing,
// too: the odometry or a joining has tied them.
void MapDrift::LinkAll(const Map& map) {
  loops_closed_ = map.loops_closed;
  links_.clear();
  using Reached = std::pair<double, KeyframeId>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  const std::vector<KeyframeId> ids = map.keyframes.Ids();
  std::vector<int> seen;
  for (const KeyframeId id : ids) seen.push_back(SeenBy(map.keyframes.At(id)));
  const auto place_of = [&](KeyframeId id) {
    return std::ranges::lower_bound(ids, id) - ids.begin();
  };
  next.emplace(0, ids.front());
  while (!next.empty()) {
    const auto [links, id] = next.top();
    next.pop();
    if (!links_.emplace(id, links).second) continue;
    const auto here = place_of(id);
    for (const Covisible& c : map.keyframes.At(id).covisible)
      next.emplace(links + Link(seen[here], seen[place_of(c.keyframe)], c.shared), c.keyframe);
    if (here > 0) next.emplace(links + 1, ids[here - 1]);
    if (here + 1 < std::ssize(ids)) next.emplace(links + 1, ids[here + 1]);
  }
}

}  // namespace oaslam
