#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "oaslam/config.h"
#include "oaslam/mapping/mapper.h"

namespace oaslam {

// Carries map commands from the tracker to the mapper, and snapshots of the map back. Sequential:
// the mapper works inside Submit. Lockstep: the mapper has its own thread, and the tracker of frame
// k gets exactly the snapshot that contains the commands of frames up to k - lag, so that results
// are the same on every run. Live: the mapper has its own thread, and the tracker gets the newest
// snapshot. The tracker mostly makes no keyframe before the last one is in the map, which keeps the
// queue short; kMaxQueued bounds it in any case. An exception of the mapper (memory runs out, an
// invariant is violated) ends the mapping, not the program: the map stays as it was before the
// command that failed, later commands are dropped, and no call waits any longer.
class MapPipeline {
 public:
  MapPipeline(const SlamConfig& config, Map map);

  static constexpr size_t kMaxQueued = 8;  // bounds how old the tracker's map may be

  // Submits a command; blocks while kMaxQueued commands are queued. In any mode, every snapshot
  // from now on contains an urgent command.
  void Submit(MapCommand command);

  std::shared_ptr<const Map> SnapshotFor(int frame_index);

  // The exception that ended the mapping; null while it works.
  std::exception_ptr failure();

  // Waits for all commands, runs the last optimisation, and returns the map.
  std::shared_ptr<const Map> Finish();
  // Waits for all commands and returns the map, which the tracker sees from then on.
  std::shared_ptr<const Map> Newest();
  // As Newest, but for another reader: does not change which snapshots the tracker gets.
  std::shared_ptr<const Map> Mapped();

 private:
  struct Published {
    uint64_t sequence = 0;  // number of commands that the map contains
    std::shared_ptr<const Map> map;
  };

  void Work(std::stop_token stop);
  void Apply(const MapCommand& command);
  void Fail(std::exception_ptr failure);
  std::shared_ptr<const Map> WaitFor(uint64_t sequence);

  RunnerMode mode_;
  int lag_;
  Mapper mapper_;  // used by the mapping thread only, while that runs
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<MapCommand> queue_;
  // Ascending; the first is the oldest that the tracker may still ask for.
  std::deque<Published> published_;
  // Frame and sequence number of the commands that are newer than the lag.
  std::deque<std::pair<int, uint64_t>> submitted_;
  uint64_t submitted_count_ = 0, applied_count_ = 0, required_ = 0;
  std::exception_ptr failure_;
  std::jthread thread_;  // the last member: destroyed first, after it has done all queued commands
};

}  // namespace oaslam
