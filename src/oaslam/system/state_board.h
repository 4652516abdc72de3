#pragma once

#include <algorithm>
#include <chrono>
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

  bool IsClosed() const {
    const std::lock_guard lock(mutex_);
    return is_closed_;
  }
  std::shared_ptr<const SlamState> Newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
  }
  std::shared_ptr<const SlamState> WaitForNext(const std::shared_ptr<const SlamState>& last,
                                               std::chrono::milliseconds timeout) const {
    // The clock's counter would overflow at longer waits.
    constexpr std::chrono::milliseconds kLongest = std::chrono::years(100);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::clamp(timeout, std::chrono::milliseconds(0), kLongest),
                      [&] { return newest_ != last || is_closed_; });
    return newest_ != last ? newest_ : nullptr;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::shared_ptr<const SlamState> newest_;
  bool is_closed_ = false;
};

}  // namespace oaslam
