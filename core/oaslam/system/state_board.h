#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>

#include "oaslam/fork.h"
#include "oaslam/slam_state.h"
#include "oaslam/system/event_log.h"

namespace oaslam {

// Where a Slam leaves its newest state and its events for other threads.
class OASLAM_LOCAL SlamStates::Board {
 public:
  // Replaces the newest state, and adds the events between the previous state and this one. Null:
  // no more states will come.
  void Post(std::shared_ptr<const SlamState> state, const ChangesBetweenStates& changes = {});

  // Throws ForkError: the board is the process's in which it was made.
  std::unique_lock<std::mutex> Lock();

  std::condition_variable changed;
  std::shared_ptr<const SlamState> newest;
  EventLog events;
  bool is_closed = false;

 private:
  std::mutex mutex_;  // guards all
  const int forks_before_ = ForksBefore();
};

}  // namespace oaslam
