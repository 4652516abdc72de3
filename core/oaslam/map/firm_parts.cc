#include "oaslam/map/firm_parts.h"

#include <algorithm>
#include <utility>

namespace oaslam {
namespace {

// Landmarks that hold the scale between two keyframes. More are better in one flat and worse in
// others (docs/lab/uncertainty.md).
constexpr int kEnough = 30;

}  // namespace

bool FirmParts::IsLoose(const Map& map, KeyframeId id) {
  if (nodes_.empty() || map.loops_closed != loops_closed_) {
    LookAtAll(map);
  } else if (seen_.insert(id).second) {
    // Its neighbours may have come to share more since they were looked at.
    Connect(map, id);
    for (const Covisible& c : map.keyframes.At(id).covisible) Connect(map, c.keyframe);
  }
  return RootOf(id) != main_;
}

void FirmParts::LookAtAll(const Map& map) {
  *this = {};
  loops_closed_ = map.loops_closed;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe&) {
    seen_.insert(id);
    Connect(map, id);
  });
  ConnectByObjects(map);
}

void FirmParts::Connect(const Map& map, KeyframeId id) {
  Unite(id, id);
  for (const Covisible& c : map.keyframes.At(id).covisible)
    if (c.shared >= kEnough) Unite(id, c.keyframe);
  const auto& motion = map.keyframes.At(id).motion;
  if (!motion || !motion->IsMetric()) return;
  if (const auto before = map.ResolveKeyframe(motion->from)) Unite(id, before->by);
}

void FirmParts::ConnectByObjects(const Map& map) {
  constexpr int kEnoughObjects = 3;
  std::map<std::pair<KeyframeId, KeyframeId>, int> shared;  // objects, by roots
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    std::set<KeyframeId> parts;
    for (const ObjectObservation& o : object.observations)
      if (const auto carried = map.ResolveKeyframe(o.reference)) parts.insert(RootOf(carried->by));
    for (const KeyframeId one : parts)
      for (const KeyframeId other : parts)
        if (one < other) ++shared[{one, other}];
  });
  for (const auto& [roots, objects] : shared)
    if (objects >= kEnoughObjects) Unite(roots.first, roots.second);
}

// The larger part keeps its root, so that the way to a root is short.
void FirmParts::Unite(KeyframeId id, KeyframeId other_id) {
  KeyframeId larger = RootOf(id), smaller = RootOf(other_id);
  if (nodes_.at(larger).keyframes < nodes_.at(smaller).keyframes) std::swap(larger, smaller);
  if (larger != smaller) {
    nodes_.at(larger).keyframes += nodes_.at(smaller).keyframes;
    nodes_.at(smaller).parent = larger;
  }
  if (main_.IsValid()) main_ = RootOf(main_);
  if (!main_.IsValid() || nodes_.at(larger).keyframes > nodes_.at(main_).keyframes) main_ = larger;
}

KeyframeId FirmParts::RootOf(KeyframeId id) {
  KeyframeId root = id;
  for (KeyframeId parent = nodes_.try_emplace(id, Node{id}).first->second.parent; parent != root;
       parent = nodes_.at(root).parent)
    root = parent;
  nodes_.at(id).parent = root;
  return root;
}

std::vector<LooseStretch> LooseStretches(const Map& map, int first_frame) {
  std::vector<std::pair<double, KeyframeId>> in_time;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.frame_index >= first_frame) in_time.emplace_back(keyframe.timestamp, id);
  });
  std::ranges::sort(in_time);
  FirmParts parts;
  std::vector<LooseStretch> stretches;
  bool goes_on = false;
  for (const auto& [time_s, id] : in_time) {
    const bool is_loose = parts.IsLoose(map, id);
    if (is_loose && !goes_on) stretches.push_back({time_s, time_s, 0, time_s});
    goes_on = is_loose;
    if (!is_loose) continue;
    LooseStretch& stretch = stretches.back();
    stretch.to_s = time_s;
    for (const Covisible& c : map.keyframes.At(id).covisible) {
      if (c.shared <= stretch.shared || parts.IsLoose(map, c.keyframe)) continue;
      stretch.shared = c.shared;
      stretch.link_s = time_s;
    }
  }
  return stretches;
}

}  // namespace oaslam
