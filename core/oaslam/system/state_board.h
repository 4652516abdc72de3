#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "oaslam/fork.h"
#include "oaslam/slam_state.h"

namespace oaslam {

// Where a Slam leaves its newest state and its events for other threads.
class OASLAM_LOCAL SlamStates::Board {
 public:
  // Replaces the newest state, and adds the events between the previous state and this one.
  // `edited_anchor`: an anchor that was edited meanwhile. Null: no more states will come.
  void Post(std::shared_ptr<const SlamState> state, const std::string& edited_anchor = {});

  // Throws ForkError: the board is the process's in which it was made.
  std::unique_lock<std::mutex> Lock();

  std::condition_variable changed;
  std::shared_ptr<const SlamState> newest;
  std::deque<SlamEvent> events;
  bool is_closed = false;

 private:
  void AddEventsSince(const SlamState& before, const std::string& edited_anchor);
  void Add(SlamEventKind kind, const std::string& anchor = {});
  uint64_t last_number_ = 0;
  std::mutex mutex_;  // guards all
  const int forks_before_ = ForksBefore();
};

}  // namespace oaslam
