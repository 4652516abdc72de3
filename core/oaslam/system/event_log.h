#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/slam_state.h"

namespace oaslam {

// The changes between two states of a Slam that a comparison of the states does not show.
struct ChangesBetweenStates {
  std::vector<WorldId> begun{}, joined{};  // submaps, by their worlds
  std::string edited_anchor{};
};

// The newest events of a Slam.
class EventLog {
 public:
  // Adds the events between two successive states.
  void Add(const SlamState& before, const SlamState& now, const ChangesBetweenStates& changes);
  // SlamStates::EventsAfter.
  std::vector<SlamEvent> After(uint64_t number) const;

 private:
  SlamEvent& AddEvent(SlamEventKind kind, const TrackingResult& now);
  void AddAnchorEvents(const SlamState& before, const SlamState& now,
                       const std::string& edited_anchor);

  std::deque<SlamEvent> events_;
  uint64_t last_number_ = 0;
  // The poses of the anchors at their last events, world_from_anchor, by name.
  std::map<std::string, Rigid3> told_anchors_;
};

}  // namespace oaslam
