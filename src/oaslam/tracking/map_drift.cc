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

// The share of landmarks that two keyframes do not share.
double Link(const Map& map, const Keyframe& keyframe, const Covisible& other) {
  const auto seen = [](const Keyframe& k) {
    return std::ranges::count_if(k.landmarks, [](LandmarkId id) { return id.IsValid(); });
  };
  const auto fewer = std::min(seen(keyframe), seen(map.keyframes.At(other.keyframe)));
  return fewer > 0 ? std::max(0.0, 1 - other.shared / static_cast<double>(fewer)) : 1;
}

}  // namespace

double MapDrift::LinksTo(const Map& map, KeyframeId id) {
  if (loops_closed_ != map.loops_closed || links_.empty()) LinkAll(map);
  if (const auto known = links_.find(id); known != links_.end()) return known->second;
  const Keyframe& keyframe = map.keyframes.At(id);
  double least = std::numeric_limits<double>::infinity();
  for (const Covisible& c : keyframe.covisible)
    if (const auto known = links_.find(c.keyframe); known != links_.end())
      least = std::min(least, known->second + Link(map, keyframe, c));
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
  using Place = std::pair<double, KeyframeId>;
  std::priority_queue<Place, std::vector<Place>, std::greater<>> next;
  const std::vector<KeyframeId> ids = map.keyframes.Ids();
  next.emplace(0, ids.front());
  while (!next.empty()) {
    const auto [links, id] = next.top();
    next.pop();
    if (!links_.emplace(id, links).second) continue;
    const Keyframe& keyframe = map.keyframes.At(id);
    for (const Covisible& c : keyframe.covisible)
      next.emplace(links + Link(map, keyframe, c), c.keyframe);
    const auto here = std::ranges::lower_bound(ids, id);
    if (here != ids.begin()) next.emplace(links + 1, *std::prev(here));
    if (std::next(here) != ids.end()) next.emplace(links + 1, *std::next(here));
  }
}

}  // namespace oaslam
