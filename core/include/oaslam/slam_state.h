#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/ids.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/tracking_result.h"
#include "oaslam/types.h"

namespace oaslam {

// The result and the map after an image, or after a call that changed the map. Immutable.
struct SlamState {
  // The result of the newest image. Its pose refers to `map`, and may be newer than what Process
  // returned (after AddDetections, Finish or SetMetresPerUnit). Until the first image after the
  // start, Load or Reset, its frame is -1 and it has no pose.
  TrackingResult result;
  MapSnapshot map;
};

// What happened to a Slam.
//
// kState, kWorld: TrackingResult::state or TrackingResult::world changed, also by Load or Reset.
//
// kSubmapBegan: the camera is lost in the main submap, and is tracked in a new one
// (TrackingResult::elsewhere). kSubmapJoined: a submap was joined with the main one, which may move
// what both contain; a pose in either of their worlds is known from now on
// (TrackingResult::PoseIn). kLoopClosed: the camera came back to a mapped place, and the map was
// corrected: poses, landmarks, objects and anchors have moved. kMetric: the map is in metres from
// now on (MapSnapshot::is_metric), also by Load.
//
// kAnchorPlaced, kAnchorRemoved: a name of an anchor was added or removed (renaming an anchor does
// both). kAnchorEdited: another model, size or place was given. kAnchorMoved: since the last event
// of the anchor, or the beginning of the world, a correction of the map or of the anchor's object
// has moved the anchor by more than a tenth of its size, or turned it by more than .1 rad.
// kAnchorLost: the object on which the anchor stands is no longer in the map; the anchor is where
// it was placed, and moves with the map around it.
enum class SlamEventKind {
  kState,
  kWorld,
  kSubmapBegan,
  kSubmapJoined,
  kLoopClosed,
  kMetric,
  kAnchorPlaced,
  kAnchorEdited,
  kAnchorMoved,
  kAnchorLost,
  kAnchorRemoved
};
// "state", "world", "submap began", "submap joined", "loop closed", "metric", "anchor placed",
// "anchor edited", "anchor moved", "anchor lost", "anchor removed".
OASLAM_API const char* ToString(SlamEventKind kind);

// An event, with what holds after it.
struct SlamEvent {
  uint64_t number = 0;  // from 1, ascending by 1
  SlamEventKind kind = SlamEventKind::kState;
  int frame = -1;                              // TrackingResult::frame of the newest image
  double timestamp = 0;                        // of that image, seconds; 0 without one
  TrackingState state = TrackingState::kLost;  // after the event
  WorldId world;                               // after the event
  // Of kSubmapBegan and kSubmapJoined: the world of that submap. Invalid for other events, and
  // where no result has named that world.
  WorldId submap{};
  std::string anchor{};  // its name; empty for other events
};

// Gives the newest state of a Slam, result and map of one moment, to other threads or to its own.
// Any thread may call every function at any time without a lock, also after the Slam is destroyed.
// Copies refer to the same Slam:
//
//   const SlamStates states = slam.States();
//   std::shared_ptr<const SlamState> newest;
//   while (!states.HasEnded())
//     if (const auto next = states.WaitForNext(newest, 100ms)) Draw(newest = next);
class OASLAM_API SlamStates {
 public:
  // The newest state; never null. Never waits for Slam.
  std::shared_ptr<const SlamState> Newest() const;
  // Whether the Slam is destroyed, so that the newest state is the last.
  bool HasEnded() const;
  // Waits for a state other than `last` and returns it; returns at once where `last` is null.
  // Returns null once `timeout` has passed, and at once where the Slam is destroyed and `last` is
  // its last state.
  std::shared_ptr<const SlamState> WaitForNext(const std::shared_ptr<const SlamState>& last,
                                               std::chrono::milliseconds timeout) const;
  // Returns the events with larger numbers than this one, the oldest first. Slam keeps the newest
  // 1000 events; it has dropped older ones where the first number returned is more than `number`
  // + 1:
  //
  //   for (const SlamEvent& event : states.EventsAfter(last)) {
  //     if (event.kind == SlamEventKind::kState) Show(event.state);
  //     last = event.number;
  //   }
  std::vector<SlamEvent> EventsAfter(uint64_t number) const;

 private:
  friend class Slam;
  class Board;
  explicit SlamStates(std::shared_ptr<Board> board);
  std::shared_ptr<Board> board_;
};

}  // namespace oaslam
