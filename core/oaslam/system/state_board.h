#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

#include "oaslam/slam_state.h"

namespace oaslam {

// Where a Slam leaves its newest state for other threads.
class OASLAM_LOCAL SlamStates::Board {
 public:
  // Null: no more states will come.
  void Post(std::shared_ptr<const SlamState> state) {
    const std::lock_guard lock(mutex);
    is_closed = !state;
    if (state) newest = std::move(state);
    changed.notify_all();
  }

  std::mutex mutex;
  std::condition_variable changed;
  std::shared_ptr<const SlamState> newest;
  bool is_closed = false;
};

}  // namespace oaslam
