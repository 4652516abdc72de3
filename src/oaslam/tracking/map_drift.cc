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

bool Parting::Update(const Image& image) {
  // Fewer landmarks hold no scale. In eleven films such passages were rare, and the largest errors
  // came after them (docs/lab/uncertainty.md).
  constexpr int kFew = 30;
  constexpr double kSeconds = 0.2, kAgreeing = 0.8, kShorter = 0.3;
  if (image.inliers >= kFew)
    few_since_.reset();
  else if (!few_since_)
    few_since_ = image.timestamp;
  const auto is_later = [&] { return image.keyframe_frame >= frame_; };
  if (links_ && image.links < *links_ - kShorter && (is_later() || !later_leads_)) links_.reset();
  const bool is_blind = few_since_ && image.timestamp - *few_since_ >= kSeconds;
  const bool parts = is_blind || image.agreeing < kAgreeing;
  if (parts) {
    if (!links_ || later_leads_) frame_ = image.frame;
    links_ = std::min(image.links, links_.value_or(image.links));
    last_frame_ = image.frame;
  }
  // Frames are counted from the first one of the map, over all films that it was made of.
  later_leads_ = links_ && image.frame - last_frame_ > last_frame_;
  return parts || (links_ && is_later() != later_leads_);
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
