#pragma once

#include <chrono>
#include <memory>

#include "oaslam/export.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/tracking_result.h"

namespace oaslam {

// What Slam knew after one image. It never changes.
struct SlamState {
  TrackingResult result;
  MapSnapshot map;  // the one in which the pose was found
};

// Hands the newest state of a Slam to other threads, which need no lock: every function may be
// called by any thread at any time, also after the Slam has gone. Copies are of the same Slam.
class OASLAM_API SlamStates {
 public:
  // The state after the newest image; null before the first one. Never waits for Slam.
  std::shared_ptr<const SlamState> Newest() const;
  // Waits until there is a state other than `last` (which may be null), and returns it. Null once
  // `timeout` has passed, or the Slam has gone.
  std::shared_ptr<const SlamState> WaitForNext(const std::shared_ptr<const SlamState>& last,
                                               std::chrono::milliseconds timeout) const;

 private:
  friend class Slam;
  class Board;
  explicit SlamStates(std::shared_ptr<Board> board);
  std::shared_ptr<Board> board_;
};

}  // namespace oaslam
