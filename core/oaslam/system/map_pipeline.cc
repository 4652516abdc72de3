#include "oaslam/system/map_pipeline.h"

#include <pthread.h>

#include <limits>
#include <utility>
#include <vector>

namespace oaslam {

MapPipeline::MapPipeline(const SlamConfig& config, Map map)
    : mode_(config.runner.mode), lag_(config.runner.lag), mapper_(config, std::move(map)) {
  published_.push_back({0, mapper_.Publish()});
  if (mode_ != RunnerMode::kSequential)
    thread_ = std::jthread([this](std::stop_token stop) { Work(stop); });
}

void MapPipeline::Submit(MapCommand command) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return queue_.size() < kMaxQueued || failure_; });
    if (failure_) return;
    const int frame_index = command.frame_index;
    const bool is_urgent = command.is_urgent;
    if (mode_ != RunnerMode::kSequential) queue_.push_back(std::move(command));
    submitted_.emplace_back(frame_index, submitted_count_ + 1);
    ++submitted_count_;
    if (is_urgent) required_ = submitted_count_;
  }
  if (mode_ == RunnerMode::kSequential) return Apply(command);
  changed_.notify_all();
}

// The lock is not held while the mapper works.
void MapPipeline::Apply(const MapCommand& command) {
  try {
    mapper_.Apply(command);
    std::shared_ptr<const Map> map = mapper_.Publish();
    const std::scoped_lock lock(mutex_);
    published_.push_back({applied_count_ + 1, std::move(map)});
    ++applied_count_;
  } catch (...) {
    Fail(std::current_exception());
  }
}

// Ends the mapping. Waiting calls return with the newest map.
void MapPipeline::Fail(std::exception_ptr failure) {
  {
    const std::scoped_lock lock(mutex_);
    failure_ = std::move(failure);
    published_.back().sequence = std::numeric_limits<uint64_t>::max();
    queue_.clear();
  }
  changed_.notify_all();
}

std::exception_ptr MapPipeline::failure() {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

void MapPipeline::Work(std::stop_token stop) {
  pthread_setname_np(pthread_self(), "oaslam-mapper");  // as debuggers and profilers show it
  for (;;) {
    MapCommand command;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return !queue_.empty(); })) return;
      command = std::move(queue_.front());
      queue_.pop_front();
    }
    Apply(command);
    changed_.notify_all();
    if (failure()) return;
  }
}

std::shared_ptr<const Map> MapPipeline::WaitFor(uint64_t sequence) {
  std::vector<Published> outdated;  // destroyed after the lock is released
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return published_.back().sequence >= sequence; });
  while (published_.front().sequence < sequence) {
    outdated.push_back(std::move(published_.front()));
    published_.pop_front();
  }
  return published_.front().map;
}

std::shared_ptr<const Map> MapPipeline::SnapshotFor(int frame_index) {
  uint64_t sequence = 0;
  {
    const std::scoped_lock lock(mutex_);
    const int newest_frame = frame_index - (mode_ == RunnerMode::kLockstep ? lag_ : 1);
    while (!submitted_.empty() && submitted_.front().first <= newest_frame) {
      // Live: the tracker does not wait for a command unless that is urgent.
      if (mode_ != RunnerMode::kLive || submitted_.front().second <= applied_count_)
        required_ = std::max(required_, submitted_.front().second);
      else
        break;
      submitted_.pop_front();
    }
    sequence = required_;
  }
  return WaitFor(sequence);
}

std::shared_ptr<const Map> MapPipeline::Newest() {
  uint64_t all = 0;
  {
    const std::scoped_lock lock(mutex_);
    all = required_ = submitted_count_;
  }
  return WaitFor(all);
}

std::shared_ptr<const Map> MapPipeline::Mapped() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return published_.back().sequence >= submitted_count_; });
  return published_.back().map;
}

std::shared_ptr<const Map> MapPipeline::Finish() {
  Newest();
  // The mapping thread is idle: nothing is queued, and only this thread submits.
  if (!failure()) {
    try {
      mapper_.Finish();
      std::shared_ptr<const Map> map = mapper_.Publish();
      const std::scoped_lock lock(mutex_);
      published_.back() = {applied_count_, std::move(map)};
    } catch (...) {
      Fail(std::current_exception());
    }
  }
  return Newest();
}

}  // namespace oaslam
