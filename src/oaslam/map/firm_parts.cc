#include "oaslam/map/firm_parts.h"

#include <algorithm>
#include <set>
#include <utility>

#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// Landmarks that hold the scale between two keyframes, and the share of what a keyframe usually
// sees, where that is little. Set on sixteen films (docs/lab/uncertainty.md).
constexpr int kEnough = 60, kLeast = 30;
constexpr double kEnoughShare = 0.2;

}  // namespace

int CountLandmarks(const Keyframe& keyframe) {
  return static_cast<int>(
      std::ranges::count_if(keyframe.landmarks, [](LandmarkId id) { return id.IsValid(); }));
}

bool FirmParts::IsLoose(const Map& map, KeyframeId id) {
  if (nodes_.empty() || map.loops_closed != loops_closed_) {
    LookAtAll(map);
  } else if (!seen_.contains(id)) {
    // Its neighbours may have come to share more since they were looked at.
    seen_[id] = CountLandmarks(map.keyframes.At(id));
    const double enough = EnoughShared();
    Connect(map, id, enough);
    for (const Covisible& c : map.keyframes.At(id).covisible) Connect(map, c.keyframe, enough);
  }
  return RootOf(id) != main_;
}

void FirmParts::LookAtAll(const Map& map) {
  *this = {};
  loops_closed_ = map.loops_closed;
  map.keyframes.ForEach(
      [&](KeyframeId id, const Keyframe& keyframe) { seen_[id] = CountLandmarks(keyframe); });
  const double enough = EnoughShared();
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe&) { Connect(map, id, enough); });
  ConnectByObjects(map);
}

double FirmParts::EnoughShared() const {
  std::vector<double> seen;
  for (const auto& [keyframe, count] : seen_) seen.push_back(count);
  return std::clamp<double>(kEnoughShare * Median(std::move(seen)), kLeast, kEnough);
}

void FirmParts::Connect(const Map& map, KeyframeId id, double enough) {
  Unite(id, id);
  for (const Covisible& c : map.keyframes.At(id).covisible)
    if (c.shared >= enough) Unite(id, c.keyframe);
}

void FirmParts::ConnectByObjects(const Map& map) {
  constexpr int kEnoughObjects = 3;
  std::map<std::pair<KeyframeId, KeyframeId>, int> shared;  // objects, by roots
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    std::set<KeyframeId> parts;
    for (const ObjectObservation& o : object.observations)
      if (seen_.contains(o.reference)) parts.insert(RootOf(o.reference));
    for (const KeyframeId one : parts)
      for (const KeyframeId other : parts)
        if (one < other) ++shared[{one, other}];
  });
  for (const auto& [roots, objects] : shared)
    if (objects >= kEnoughObjects) Unite(roots.first, roots.second);
}

void FirmParts::Unite(KeyframeId id, KeyframeId other_id) {
  const KeyframeId one = RootOf(id), other = RootOf(other_id);
  if (one != other) {
    nodes_.at(one).keyframes += nodes_.at(other).keyframes;
    nodes_.at(other).parent = one;
  }
  if (main_.IsValid()) main_ = RootOf(main_);
  if (!main_.IsValid() || nodes_.at(one).keyframes > nodes_.at(main_).keyframes) main_ = one;
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
  FirmParts parts;
  std::vector<LooseStretch> stretches;
  bool goes_on = false;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.frame_index < first_frame) return;
    const bool is_loose = parts.IsLoose(map, id);
    if (is_loose && !goes_on) stretches.push_back({.from_s = keyframe.timestamp});
    goes_on = is_loose;
    if (!is_loose) return;
    LooseStretch& stretch = stretches.back();
    stretch.to_s = keyframe.timestamp;
    for (const Covisible& c : keyframe.covisible) {
      if (c.shared <= stretch.shared || parts.IsLoose(map, c.keyframe)) continue;
      stretch.shared = c.shared;
      stretch.link_s = keyframe.timestamp;
    }
    if (stretch.shared == 0) stretch.link_s = stretch.from_s;
  });
  return stretches;
}

}  // namespace oaslam
