#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "oaslam/slam_state.h"

namespace oaslam {

// Where a Slam leaves its newest state and its events for other threads.
class OASLAM_LOCAL SlamStates::Board {
 public:
  // Replaces the newest state, and adds the events between the previous state and this one. Null:
  // no more states will come.
  void Post(std::shared_ptr<const SlamState> state);
  // Adds the edit of an anchor to the events of the newest state.
  void PostEdit(const std::string& anchor);

  std::mutex mutex;
  std::condition_variable changed;
  std::shared_ptr<const SlamState> newest;
  std::deque<SlamEvent> events;
  bool is_closed = false;

 private:
  void AddEventsSince(const SlamState& before);
  void Add(SlamEventKind kind, const std::string& anchor = {});
  uint64_t last_number_ = 0;
};

}  // namespace oaslam
