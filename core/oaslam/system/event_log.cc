#include "oaslam/system/event_log.h"

#include <algorithm>
#include <utility>

#include "oaslam/anchors/editing.h"
#include "oaslam/relocalization/snapshot_content.h"

namespace oaslam {
namespace {

// Whether content of this size has moved visibly.
bool HasMoved(const Rigid3& from, const Rigid3& to, double size) {
  constexpr double kShareOfSize = 0.1, kAngleRad = 0.1;
  return (to.translation - from.translation).norm() > kShareOfSize * size ||
         from.rotation.angularDistance(to.rotation) > kAngleRad;
}

bool StandsOnObject(const Map& map, const Anchor& anchor) {
  return anchor.object.IsValid() && map.ResolveObject(anchor.object);
}

}  // namespace

SlamEvent& EventLog::AddEvent(SlamEventKind kind, const TrackingResult& now) {
  constexpr size_t kMost = 1000;
  if (events_.size() == kMost) events_.pop_front();
  return events_.emplace_back(
      SlamEvent{++last_number_, kind, now.frame, now.timestamp, now.state, now.world});
}

void EventLog::Add(const SlamState& before, const SlamState& now,
                   const ChangesBetweenStates& changes) {
  const Map &had = *MapOf(before.map), &has = *MapOf(now.map);
  const bool is_new_world = now.result.world != before.result.world;
  const auto add = [&](SlamEventKind kind) -> SlamEvent& { return AddEvent(kind, now.result); };
  for (const WorldId submap : changes.begun) add(SlamEventKind::kSubmapBegan).submap = submap;
  for (const WorldId submap : changes.joined) add(SlamEventKind::kSubmapJoined).submap = submap;
  if (is_new_world) add(SlamEventKind::kWorld);
  if (now.result.state != before.result.state) add(SlamEventKind::kState);
  // A joined submap adds to this number, too.
  if (!is_new_world && changes.joined.empty() && has.loops_closed > had.loops_closed)
    add(SlamEventKind::kLoopClosed);
  if (has.is_metric && !had.is_metric) add(SlamEventKind::kMetric);
  if (&had != &has) AddAnchorEvents(before, now, changes.edited_anchor);
}

void EventLog::AddAnchorEvents(const SlamState& before, const SlamState& now,
                               const std::string& edited_anchor) {
  const Map &had = *MapOf(before.map), &has = *MapOf(now.map);
  const auto add = [&](SlamEventKind kind, const std::string& anchor) {
    AddEvent(kind, now.result).anchor = anchor;
  };
  for (const auto& [name, anchor] : had.anchors)
    if (!has.anchors.contains(name)) add(SlamEventKind::kAnchorRemoved, name);
  const auto told = std::exchange(told_anchors_, {});
  for (const AnchorPose& anchor : PosesOf(has)) {
    Rigid3& pose = told_anchors_[anchor.name] = anchor.world_from_anchor;
    const auto former = had.anchors.find(anchor.name);
    const auto last = told.find(anchor.name);
    if (former == had.anchors.end()) {
      add(SlamEventKind::kAnchorPlaced, anchor.name);
    } else if (anchor.name == edited_anchor) {
      add(SlamEventKind::kAnchorEdited, anchor.name);
    } else if (now.result.world == before.result.world && last != told.end()) {
      if (HasMoved(last->second, pose, anchor.size))
        add(SlamEventKind::kAnchorMoved, anchor.name);
      else
        pose = last->second;
      if (StandsOnObject(had, former->second) && !StandsOnObject(has, has.anchors.at(anchor.name)))
        add(SlamEventKind::kAnchorLost, anchor.name);
    }
  }
}

std::vector<SlamEvent> EventLog::After(uint64_t number) const {
  const auto first = std::ranges::upper_bound(events_, number, {}, &SlamEvent::number);
  return {first, events_.end()};
}

}  // namespace oaslam
