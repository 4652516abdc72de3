#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>

#include "oaslam/slam_state.h"

namespace oaslam {

// Where a Slam leaves its newest state for other threads.
class OASLAM_LOCAL SlamStates::Board {
 public:
  void Post(std::shared_ptr<const SlamState> state) {
    {
      const std::lock_guard lock(mutex_);
      newest_ = std::move(state);
    }
    changed_.notify_all();
  }
  // No more states will come.
  void Close() {
    {
      const std::lock_guard lock(mutex_);
      is_closed_ = true;
    }
    changed_.notify_all();
  }

  std::shared_ptr<const SlamState> Newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
  }
  std::shared_ptr<const SlamState> WaitForNext(const std::shared_ptr<const SlamState>& last,
                                               std::chrono::milliseconds timeout) const {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return newest_ != last || is_closed_; });
    return newest_ != last ? newest_ : nullptr;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::shared_ptr<const SlamState> newest_;
  bool is_closed_ = false;
};

}  // namespace oaslam
