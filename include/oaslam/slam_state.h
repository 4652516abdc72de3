#pragma once

#include <chrono>
#include <memory>

#include "oaslam/export.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/tracking_result.h"

namespace oaslam {

// What Slam knew after an image, or after a call that changed the map. It never changes.
struct SlamState {
  // That of the newest image, with its pose in the map below, also where that came later (by
  // AddDetections, Finish or SetMetresPerUnit). Before the first image since the start, Load or
  // Reset its frame is -1 and it has no pose.
  TrackingResult result;
  MapSnapshot map;
};

// Hands the newest state of a Slam to other threads, which need no lock: every function may be
// called by any thread at any time, also after the Slam has gone. Copies are of the same Slam.
class OASLAM_API SlamStates {
 public:
  // The newest state; never null. Never waits for Slam.
  std::shared_ptr<const SlamState> Newest() const;
  // Whether the Slam has gone: the newest state is the last.
  bool HasEnded() const;
  // Waits until there is a state other than `last` (which may be null: returns at once), and
  // returns it. Null once `timeout` has passed, and at once where the Slam has gone and `last` is
  // its last state.
  std::shared_ptr<const SlamState> WaitForNext(const std::shared_ptr<const SlamState>& last,
                                               std::chrono::milliseconds timeout) const;

 private:
  friend class Slam;
  class Board;
  explicit SlamStates(std::shared_ptr<Board> board);
  std::shared_ptr<Board> board_;
};

}  // namespace oaslam
