#pragma once

#include <chrono>
#include <memory>

#include "oaslam/export.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/tracking_result.h"

namespace oaslam {

// The result and the map after an image, or after a call that changed the map. Immutable.
struct SlamState {
  // The result of the newest image. Its pose refers to `map`, and may be newer than what Process
  // returned (after AddDetections, Finish or SetMetresPerUnit). Until the first image after the
  // start, Load or Reset, its frame is -1 and it has no pose.
  TrackingResult result;
  MapSnapshot map;
};

// Gives the newest state of a Slam, result and map of one moment, to other threads or to its own.
// Any thread may call every function at any time without a lock, also after the Slam is destroyed.
// Copies refer to the same Slam.
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

 private:
  friend class Slam;
  class Board;
  explicit SlamStates(std::shared_ptr<Board> board);
  std::shared_ptr<Board> board_;
};

}  // namespace oaslam
