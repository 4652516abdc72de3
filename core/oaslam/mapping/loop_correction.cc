#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "oaslam/bundle/pose_graph.h"
#include "oaslam/map/joining.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/map/scale_drift.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/matching/fusion.h"

namespace oaslam {
namespace {

constexpr int kNeighbours = 10;        // keyframes around each end, whose landmarks are fused
constexpr double kFusionRadiusPx = 5;  // the error left after the pose graph

// Keyframes that share this many landmarks get an edge in the pose graph, so that only well
// determined relative poses count; and each keyframe gets one to the earlier keyframe with which it
// shares most, so that the graph is connected.
constexpr int kMinEdgeShared = 50;

// The largest number of nodes, which bounds the time. In larger maps every n-th keyframe is a node,
// and the keyframes up to the next node move with it.
constexpr size_t kMaxNodes = 500;

// Whether a keyframe shares no landmark with the one before it, since the camera was lost in
// between.
bool IsAfterGap(const Map& map, KeyframeId before, KeyframeId id) {
  const std::vector<Covisible>& covisible = map.keyframes.At(id).covisible;
  return std::ranges::find(covisible, before, &Covisible::keyframe) == covisible.end();
}

// The keyframes that are nodes of the pose graph, ascending; those after a gap always are.
std::vector<KeyframeId> NodesOf(const Map& map, const std::vector<KeyframeId>& ids,
                                std::set<KeyframeId> always) {
  const size_t stride = (ids.size() + kMaxNodes - 1) / kMaxNodes;
  for (size_t i = 0; i < ids.size(); ++i)
    if (i % stride == 0 || IsAfterGap(map, ids[i - 1], ids[i])) always.insert(ids[i]);
  return {always.begin(), always.end()};
}

// The index of the node with which the keyframe moves.
int NodeOf(const std::vector<KeyframeId>& nodes, KeyframeId id) {
  return static_cast<int>(std::ranges::upper_bound(nodes, id) - nodes.begin()) - 1;
}

// How well two keyframes hold the way between them and the scale: by the odometry, or by the
// landmarks that both see, a hundred as well as any, few next to nothing. What a loop finds off was
// lost at a few such places, as doorways are, and goes there instead of bending what was right.
double HeldBy(const Keyframe& one, const Keyframe& other, int shared) {
  constexpr double kLeast = 1e-3;
  // Sigma of the logarithm of the scale, from which on a link holds its scale as it holds
  // rotations.
  constexpr double kBest = 0.004;
  constexpr double kEnough = 100;
  const auto variance = ScaleVarianceByOdometry(one, other, shared);
  return std::clamp(variance ? kBest / std::sqrt(std::max(*variance, kBest * kBest))
                             : std::pow(shared / kEnough, 2),
                    kLeast, 1.0);
}

std::vector<PoseGraphEdge> EdgesBetween(const Map& map, const std::vector<KeyframeId>& ids,
                                        const std::vector<KeyframeId>& node_ids,
                                        const std::vector<Similarity>& nodes) {
  std::vector<PoseGraphEdge> edges;
  std::set<std::pair<int, int>> known;
  const auto add = [&](int from, int to, int shared) {
    if (from != to && known.emplace(from, to).second)
      edges.push_back(
          {from, to, nodes[to] * nodes[from].Inverse(),
           HeldBy(map.keyframes.At(node_ids[from]), map.keyframes.At(node_ids[to]), shared),
           map.MedianDepth(node_ids[to])});
  };
  for (size_t i = 1; i < ids.size(); ++i) {
    const int from = NodeOf(node_ids, ids[i]);
    bool has_closest = false;
    for (const Covisible& c : map.keyframes.At(ids[i]).covisible) {  // most shared first
      if (c.keyframe > ids[i] || (has_closest && c.shared < kMinEdgeShared)) continue;
      add(from, NodeOf(node_ids, c.keyframe), c.shared);
      has_closest = true;
    }
    if (!has_closest) add(from, NodeOf(node_ids, ids[i - 1]), 0);
  }
  return edges;
}

// How points near each keyframe move when the pose graph moves its node.
struct NodeMotions {
  std::vector<KeyframeId> ids;
  std::vector<Similarity> new_from_old;  // of world points

  const Similarity& Of(KeyframeId id) const {
    return new_from_old[std::ranges::lower_bound(ids, id) - ids.begin()];
  }
};

// Moves the objects, and scales what is stored relative to keyframes: retired keyframes,
// observations of objects, and anchors.
void MoveWithKeyframes(const NodeMotions& motions, Map& map) {
  for (const KeyframeId id : map.retired.Ids())
    if (const auto carried = map.ResolveKeyframe(id)) {
      RetiredKeyframe& retired = map.retired.MutableAt(id);
      const double scale = motions.Of(carried->by).scale;
      retired.cam_from_parent.translation *= scale;
      retired.unit *= scale;
    }
  for (const ObjectId id : map.objects.Ids()) {
    Object& object = map.objects.MutableAt(id);
    for (size_t i = 0; i < object.observations.size(); ++i) {
      const auto carried = map.ResolveKeyframe(object.observations[i].reference);
      if (!carried) continue;
      const Similarity& motion = motions.Of(carried->by);
      object.observations[i].ScaleLengths(motion.scale);
      if (i == object.observations.size() / 2) MoveObject(motion, object);
    }
  }
  for (auto& [name, anchor] : map.anchors)
    if (const auto carried = map.ResolveKeyframe(anchor.keyframe))
      anchor.Scale(motions.Of(carried->by).scale);
}

// The motion of a keyframe between two nodes, interpolated between theirs by its position in the
// order of keyframes.
Similarity Between(const Similarity& first, const Similarity& second, double share,
                   const Eigen::Vector3d& center) {
  const double scale = std::exp(std::lerp(std::log(first.scale), std::log(second.scale), share));
  const Eigen::Quaterniond rotation = first.rotation.slerp(share, second.rotation);
  const Eigen::Vector3d moved = (1 - share) * (first * center) + share * (second * center);
  return {scale, rotation, moved - scale * (rotation * center)};
}

// The first node beyond the weakest link between two nodes, both given by index: where no two
// keyframes on either side share many landmarks.
size_t BeyondWeakestLink(const Map& map, const std::vector<KeyframeId>& ids,
                         const std::vector<KeyframeId>& node_ids, size_t first, size_t last) {
  std::vector<int> seen_across(node_ids.size(), 0);  // by the node before
  for (const KeyframeId id : ids)
    for (const Covisible& c : map.keyframes.At(id).covisible) {
      if (id < c.keyframe) continue;
      for (int k = NodeOf(node_ids, c.keyframe); k < NodeOf(node_ids, id); ++k)
        seen_across[k] = std::max(seen_across[k], c.shared);
    }
  const auto begin = seen_across.begin() + static_cast<std::ptrdiff_t>(first),
             end = seen_across.begin() + static_cast<std::ptrdiff_t>(last);
  return static_cast<size_t>(std::min_element(begin, end) - seen_across.begin()) + 1;
}

// Returns false and changes nothing if no correction was found.
bool SpreadCorrection(const LoopClosure& loop, KeyframeId held, Map& map) {
  NodeMotions motions{map.keyframes.Ids(), {}};
  if (!held.IsValid()) held = motions.ids.front();
  const std::vector<KeyframeId> node_ids =
      NodesOf(map, motions.ids, {held, loop.old, loop.current});
  std::vector<Similarity> nodes;
  for (const KeyframeId id : node_ids) nodes.emplace_back(map.keyframes.At(id).cam_from_world);
  std::vector<PoseGraphEdge> edges = EdgesBetween(map, motions.ids, node_ids, nodes);
  std::vector<Similarity> start = nodes;
  std::vector<char> fixed(nodes.size(), 0);
  for (const KeyframeId id : {held, loop.old}) fixed[NodeOf(node_ids, id)] = 1;
  const int current = NodeOf(node_ids, loop.current), old = NodeOf(node_ids, loop.old);
  start[current] = nodes[current] * loop.old_from_current.Inverse();
  if (loop.is_scale_known)
    fixed[current] = 1;
  else  // The camera is where it was found; how long things are there, the way tells.
    edges.push_back(
        {old, current, start[current] * nodes[old].Inverse(), 1, map.MedianDepth(loop.old), false});
  // What lies beyond the weakest link begins as moved as a whole, if the held one is before it.
  if (old < current) {
    const size_t beyond = BeyondWeakestLink(map, motions.ids, node_ids, static_cast<size_t>(old),
                                            static_cast<size_t>(current));
    if (held < node_ids[beyond])
      for (size_t k = beyond; k < nodes.size(); ++k)
        if (!fixed[k]) start[k] = nodes[k] * loop.old_from_current.Inverse();
  }
  const auto moved = OptimizePoseGraph(start, edges, fixed);
  if (!moved) return false;

  std::vector<Similarity> node_motions;
  for (size_t i = 0; i < nodes.size(); ++i)
    node_motions.push_back((*moved)[i].Inverse() * nodes[i]);
  for (const KeyframeId id : motions.ids) {
    const auto node = static_cast<size_t>(NodeOf(node_ids, id));
    // A keyframe moves only with nodes on its own side of a gap.
    const auto next = std::ranges::lower_bound(
        motions.ids, node + 1 < node_ids.size() ? node_ids[node + 1] : KeyframeId());
    const bool is_last = next == motions.ids.end() || IsAfterGap(map, *std::prev(next), *next);
    if (node_ids[node] == id || is_last) {
      motions.new_from_old.push_back(node_motions[node]);
      continue;
    }
    const double share =
        static_cast<double>(id.value - node_ids[node].value) / (next->value - node_ids[node].value);
    motions.new_from_old.push_back(Between(node_motions[node], node_motions[node + 1], share,
                                           map.keyframes.At(id).cam_from_world.OriginInSource()));
  }
  for (const LandmarkId id : map.landmarks.Ids()) {
    Landmark& landmark = map.landmarks.MutableAt(id);
    landmark.position = motions.Of(landmark.observations.front().keyframe) * landmark.position;
  }
  MoveWithKeyframes(motions, map);
  for (size_t i = 0; i < motions.ids.size(); ++i) {
    Keyframe& keyframe = map.keyframes.MutableAt(motions.ids[i]);
    keyframe.cam_from_world =
        (Similarity(keyframe.cam_from_world) * motions.new_from_old[i].Inverse()).AsPose();
    keyframe.ScaleLengths(motions.new_from_old[i].scale);
    keyframe.unit *= motions.new_from_old[i].scale;
  }
  return true;
}

// The keyframes whose covisibility is recomputed: in a small map all, in a large one those around
// the ends of the loop, where landmarks will be merged.
std::vector<KeyframeId> KeyframesToLink(const Map& map, const std::vector<KeyframeId>& ends,
                                        const std::vector<LandmarkId>& old) {
  if (map.keyframes.size() <= kMaxNodes) return map.keyframes.Ids();
  std::set<KeyframeId> fused(ends.begin(), ends.end());
  for (const LandmarkId id : old)
    if (const Landmark* landmark = map.landmarks.Find(id))
      for (const Observation& o : landmark->observations) fused.insert(o.keyframe);
  return {fused.begin(), fused.end()};
}

}  // namespace

bool CorrectLoop(const LoopClosure& loop, Map& map, KeyframeId held) {
  const std::vector<KeyframeId> ends = map.KeyframesAround(loop.current, kNeighbours);
  const std::vector<LandmarkId> old =
      LandmarksSeenBy(map, map.KeyframesAround(loop.old, kNeighbours));
  if (!SpreadCorrection(loop, held, map)) return false;

  const std::vector<KeyframeId> to_link = KeyframesToLink(map, ends, old);
  std::vector<FusionCandidate> seen;
  for (const auto& [keypoint, landmark] : loop.old_landmarks) seen.push_back({landmark, keypoint});
  ApplyFusion(seen, loop.current, map);
  for (const KeyframeId id : ends)
    ApplyFusion(FindFusionCandidates(map, id, old, kFusionRadiusPx), id, map);
  for (const LandmarkId id : map.landmarks.Ids()) map.UpdateLandmarkGeometry(id);
  for (const KeyframeId id : to_link) map.UpdateCovisibility(id);
  return true;
}

}  // namespace oaslam
