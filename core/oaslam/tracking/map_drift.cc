#include "oaslam/tracking/map_drift.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "oaslam/map/scale_drift.h"

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

// The variance of the logarithm of the scale of one keyframe relative to another. Of maps that were
// loaded, and of motion that others give, nothing is known.
double ScaleVariance(const Keyframe& one, const Keyframe& other, int shared) {
  constexpr double kOfLandmark = 0.15;  // sigma by one landmark that both see: a guess
  if (!one.scale_drift || !other.scale_drift) return 0;
  return ScaleVarianceByOdometry(one, other, shared)
      .value_or(kOfLandmark * kOfLandmark / std::max(1, shared));
}

// A chain with one more link. What the link loses of the scale, it loses from where it begins.
ChainOfViews Extended(ChainOfViews chain, const Keyframe& from, const Keyframe& to, double link,
                      int shared) {
  chain.Add(link, ScaleVariance(from, to, shared), from.cam_from_world.OriginInSource());
  return chain;
}

using Chains = std::map<KeyframeId, ChainOfViews>;

// Dijkstra's shortest paths. Keyframes that follow each other are linked where they share nothing,
// too: the odometry or a joining has tied them.
Chains ChainsFrom(KeyframeId first, const Map& map) {
  struct Reached {
    double links;
    KeyframeId id, from;
    int shared;
    bool operator>(const Reached& other) const {
      return std::tuple(links, id, from) > std::tuple(other.links, other.id, other.from);
    }
  };
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  const std::vector<KeyframeId> ids = map.keyframes.Ids();
  std::vector<int> seen;
  for (const KeyframeId id : ids) seen.push_back(SeenBy(map.keyframes.At(id)));
  const auto place_of = [&](KeyframeId id) {
    return std::ranges::lower_bound(ids, id) - ids.begin();
  };
  Chains chains;
  next.push({0, first, first, 0});
  while (!next.empty()) {
    const auto [links, id, from, shared] = next.top();
    next.pop();
    if (chains.contains(id)) continue;
    const Keyframe& keyframe = map.keyframes.At(id);
    ChainOfViews chain;
    if (id != from) {
      const ChainOfViews& before = chains.at(from);
      chain = Extended(before, map.keyframes.At(from), keyframe, links - before.links, shared);
    }
    chains.emplace(id, chain);
    const auto here = place_of(id);
    for (const Covisible& c : keyframe.covisible)
      next.push({chain.links + Link(seen[here], seen[place_of(c.keyframe)], c.shared), c.keyframe,
                 id, c.shared});
    if (here > 0) next.push({chain.links + 1, ids[here - 1], id, 0});
    if (here + 1 < std::ssize(ids)) next.push({chain.links + 1, ids[here + 1], id, 0});
  }
  return chains;
}

// The median keyframe by how far the scale has wandered up to it.
KeyframeId MiddleOf(const Chains& chains) {
  std::vector<std::pair<double, KeyframeId>> by_scale;
  for (const auto& [id, chain] : chains) by_scale.emplace_back(chain.scale, id);
  const auto middle = by_scale.begin() + std::ssize(by_scale) / 2;
  std::ranges::nth_element(by_scale, middle);
  return middle->second;
}

}  // namespace

void ChainOfViews::Add(double link, double scale_variance, const Eigen::Vector3d& at) {
  links += link;
  scale += scale_variance;
  scale_at += scale_variance * at;
  scale_at_squared += scale_variance * at.squaredNorm();
}

double ChainOfViews::SquaredOffByScale(const Eigen::Vector3d& position) const {
  return std::max(0.0,
                  scale * position.squaredNorm() - 2 * position.dot(scale_at) + scale_at_squared);
}

void ChainOfViews::Scale(double factor) {
  scale_at *= factor;
  scale_at_squared *= factor * factor;
}

const ChainOfViews& MapDrift::ChainTo(const Map& map, KeyframeId id) {
  constexpr double kGrown = 1.5;
  if (loops_closed_ != map.loops_closed ||
      static_cast<double>(map.keyframes.size()) >= kGrown * static_cast<double>(linked_))
    LinkAll(map);
  if (const auto known = chains_.find(id); known != chains_.end()) return known->second;
  const Keyframe& keyframe = map.keyframes.At(id);
  const int seen = SeenBy(keyframe);
  std::optional<ChainOfViews> shortest;
  for (const Covisible& c : keyframe.covisible) {
    const auto known = chains_.find(c.keyframe);
    if (known == chains_.end()) continue;
    const Keyframe& other = map.keyframes.At(c.keyframe);
    const ChainOfViews chain =
        Extended(known->second, other, keyframe, Link(seen, SeenBy(other), c.shared), c.shared);
    if (!shortest || chain.links < shortest->links) shortest = chain;
  }
  if (shortest)
    chains_.emplace(id, *shortest);
  else
    LinkAll(map);
  return chains_.at(id);
}

void MapDrift::Scale(double factor) {
  for (auto& [id, chain] : chains_) chain.Scale(factor);
}

void MapDrift::LinkAll(const Map& map) {
  loops_closed_ = map.loops_closed;
  linked_ = map.keyframes.size();
  chains_ = ChainsFrom(MiddleOf(ChainsFrom(map.keyframes.Ids().front(), map)), map);
}

}  // namespace oaslam
