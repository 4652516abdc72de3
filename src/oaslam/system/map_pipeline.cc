#include "oaslam/system/map_pipeline.h"

#include <utility>

#include "oaslam/util/check.h"

namespace oaslam {
namespace {

RunnerMode ModeOf(const std::string& name) {
  if (name == "sequential") return RunnerMode::kSequential;
  return name == "live" ? RunnerMode::kLive : RunnerMode::kLockstep;
}

}  // namespace

MapPipeline::MapPipeline(const SlamConfig& config, Map map)
    : mode_(ModeOf(config.runner.mode)), lag_(config.runner.lag), mapper_(config, std::move(map)) {
  published_.push_back({0, mapper_.Publish()});
  if (mode_ != RunnerMode::kSequential)
    thread_ = std::jthread([this](std::stop_token stop) { Work(stop); });
}

void MapPipeline::Submit(MapCommand command, bool wait) {
  std::unique_lock lock(mutex_);
  ++submitted_count_;
  submitted_.emplace_back(command.frame_index, submitted_count_);
  if (wait) required_ = submitted_count_;
  if (mode_ == RunnerMode::kSequential) {
    mapper_.Apply(command);
    applied_count_ = submitted_count_;
    published_.push_back({applied_count_, mapper_.Publish()});
    return;
  }
  changed_.wait(lock, [&] { return queue_.size() < kMaxQueued; });
  queue_.push_back(std::move(command));
  lock.unlock();
  changed_.notify_all();
}

void MapPipeline::Work(std::stop_token stop) {
  for (;;) {
    MapCommand command;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return !queue_.empty(); })) return;
      command = std::move(queue_.front());
      queue_.pop_front();
    }
    mapper_.Apply(command);
    Published published{0, mapper_.Publish()};
    {
      const std::scoped_lock lock(mutex_);
      published.sequence = ++applied_count_;
      published_.push_back(std::move(published));
    }
    changed_.notify_all();
  }
}

std::shared_ptr<const Map> MapPipeline::WaitFor(uint64_t sequence) {
  std::deque<Published> outdated;  // freed after the lock
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
      // Live: the tracker does not wait for a command unless that was submitted with `wait`.
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

size_t MapPipeline::QueueLength() {
  const std::scoped_lock lock(mutex_);
  return queue_.size();
}

std::shared_ptr<const Map> MapPipeline::Finish() {
  Newest();
  // The mapping thread is idle: nothing is queued, and only this thread submits.
  mapper_.Finish();
  auto map = mapper_.Publish();
  const std::scoped_lock lock(mutex_);
  published_.clear();
  published_.push_back({applied_count_, map});
  return map;
}

void MapPipeline::Shutdown() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
  mode_ = RunnerMode::kSequential;
  for (const MapCommand& command : std::exchange(queue_, {})) {
    mapper_.Apply(command);
    published_.push_back({++applied_count_, mapper_.Publish()});
  }
}

}  // namespace oaslam
