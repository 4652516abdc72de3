#include <algorithm>

#include "oaslam/bundle/pose_graph.h"
#include "oaslam/map/joining.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/matching/fusion.h"

namespace oaslam {
namespace {

constexpr int kNeighbours = 10;
constexpr double kFusionRadiusPx = 5;

std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId keyframe) {
  std::vector<KeyframeId> group = map.CovisibleKeyframes(keyframe, kNeighbours);
  group.push_back(keyframe);
  return LandmarksSeenBy(map, group);
}

// Keyframes that share this many landmarks get an edge in the pose graph, and each keyframe gets
// one to the earlier keyframe with which it shares most.
constexpr int kMinEdgeShared = 50;

std::vector<PoseGraphEdge> EdgesBetween(const Map& map, const std::vector<KeyframeId>& ids,
                                        const std::vector<Similarity>& nodes) {
  std::vector<PoseGraphEdge> edges;
  const auto index_of = [&](KeyframeId id) {
    return static_cast<int>(std::ranges::lower_bound(ids, id) - ids.begin());
  };
  const auto add = [&](int from, int to) {
    edges.push_back({from, to, nodes[to] * nodes[from].Inverse()});
  };
  for (int i = 1; i < static_cast<int>(ids.size()); ++i) {
    bool has_closest = false;
    for (const Covisible& c : map.keyframes.At(ids[i]).covisible) {  // most shared first
      if (c.keyframe > ids[i] || (has_closest && c.shared < kMinEdgeShared)) continue;
      add(i, index_of(c.keyframe));
      has_closest = true;
    }
    if (!has_closest) add(i, i - 1);
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

// Scales what is stored relative to keyframes: retired keyframes, observations of
// objects, and anchors.
void ScaleRelativePoses(const NodeMotions& motions, Map& map) {
  for (const KeyframeId id : map.retired.Ids())
    if (const auto carried = map.ResolveKeyframe(id))
      map.retired.MutableAt(id).cam_from_parent.translation *= motions.Of(carried->by).scale;
  for (const ObjectId id : map.objects.Ids())
    for (ObjectObservation& o : map.objects.MutableAt(id).observations)
      if (const auto carried = map.ResolveKeyframe(o.reference))
        o.cam_from_reference.translation *= motions.Of(carried->by).scale;
  for (auto& [name, anchor] : map.anchors)
    if (const auto carried = map.ResolveKeyframe(anchor.keyframe))
      anchor.Scale(motions.Of(carried->by).scale);
}

void MoveObjects(const NodeMotions& motions, Map& map) {
  for (const ObjectId id : map.objects.Ids()) {
    Object& object = map.objects.MutableAt(id);
    if (object.observations.empty()) continue;
    const auto carried =
        map.ResolveKeyframe(object.observations[object.observations.size() / 2].reference);
    if (!carried) continue;
    MoveObject(motions.Of(carried->by), object);
  }
}

// Returns false and changes nothing if no correction was found.
bool SpreadCorrection(const LoopClosure& loop, KeyframeId held, Map& map) {
  NodeMotions motions{map.keyframes.Ids(), {}};
  const auto index_of = [&](KeyframeId id) {
    return static_cast<size_t>(std::ranges::lower_bound(motions.ids, id) - motions.ids.begin());
  };
  std::vector<Similarity> nodes;
  for (const KeyframeId id : motions.ids) nodes.emplace_back(map.keyframes.At(id).cam_from_world);
  const std::vector<PoseGraphEdge> edges = EdgesBetween(map, motions.ids, nodes);
  std::vector<Similarity> start = nodes;
  std::vector<char> fixed(nodes.size(), 0);
  fixed[held.IsValid() ? index_of(held) : 0] = fixed[index_of(loop.old)] =
      fixed[index_of(loop.current)] = 1;
  start[index_of(loop.current)] = nodes[index_of(loop.current)] * loop.old_from_current.Inverse();
  const double depth = map.MedianDepth(loop.old);
  const auto moved = OptimizePoseGraph(start, edges, fixed, depth > 0 ? depth : 1);
  if (!moved) return false;

  for (size_t i = 0; i < nodes.size(); ++i)
    motions.new_from_old.push_back((*moved)[i].Inverse() * nodes[i]);
  for (const LandmarkId id : map.landmarks.Ids()) {
    Landmark& landmark = map.landmarks.MutableAt(id);
    landmark.position = motions.Of(landmark.observations.front().keyframe) * landmark.position;
  }
  MoveObjects(motions, map);
  ScaleRelativePoses(motions, map);
  for (size_t i = 0; i < nodes.size(); ++i)
    map.keyframes.MutableAt(motions.ids[i]).cam_from_world = (*moved)[i].AsPose();
  return true;
}

}  // namespace

bool CorrectLoop(const LoopClosure& loop, int min_shared_landmarks, Map& map, KeyframeId held) {
  std::vector<KeyframeId> ends = map.CovisibleKeyframes(loop.current, kNeighbours);
  ends.push_back(loop.current);
  const std::vector<LandmarkId> old = LandmarksAround(map, loop.old);
  if (!SpreadCorrection(loop, held, map)) return false;

  std::vector<FusionCandidate> seen;
  for (const auto& [keypoint, landmark] : loop.old_landmarks) seen.push_back({landmark, keypoint});
  ApplyFusion(seen, loop.current, map);
  for (const KeyframeId id : ends)
    ApplyFusion(FindFusionCandidates(map, id, old, kFusionRadiusPx), id, map);
  for (const LandmarkId id : map.landmarks.Ids()) map.UpdateLandmarkGeometry(id);
  for (const KeyframeId id : map.keyframes.Ids()) map.UpdateCovisibility(id, min_shared_landmarks);
  return true;
}

}  // namespace oaslam
