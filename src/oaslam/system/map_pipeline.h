#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "oaslam/config.h"
#include "oaslam/system/mapper.h"

namespace oaslam {

enum class RunnerMode { kSequential, kLockstep, kLive };

// Takes map commands from the tracker to the mapper, and snapshots back.
// Sequential: the mapper works inside Submit. Lockstep: on its own thread, and the tracker of frame
// k gets exactly the snapshot that holds the commands of the frames up to k - lag, so that results
// are the same on every run. Live: on its own thread, newest snapshot; the tracker asks for no
// keyframe while the last one is not yet in the map, which keeps the queue short, and it is bounded
// all the same.
// An exception while the mapper works (memory has run out, an invariant is broken) ends the
// mapping, not the program: the map stays for good as it was before the command that failed, and
// what is submitted is dropped. Nobody who waits for a command is kept waiting.
class MapPipeline {
 public:
  MapPipeline(const SlamConfig& config, Map map);
  ~MapPipeline() { Shutdown(); }

  static constexpr size_t kMaxQueued = 8;

  // Hands a command over; waits where kMaxQueued commands wait already. With `wait` it is in every
  // snapshot from now on, whatever the mode.
  void Submit(MapCommand command, bool wait);

  // The snapshot for the tracker of a frame.
  std::shared_ptr<const Map> SnapshotFor(int frame_index);

  // The exception that has ended the mapping; null while it goes on.
  std::exception_ptr failure();

  // Waits for all commands, runs the last optimisation, and returns the map.
  std::shared_ptr<const Map> Finish();
  // Waits for all commands.
  std::shared_ptr<const Map> Newest();

  size_t QueueLength();

  // Ends the thread, with nothing lost: from now on the mapper works inside the calls. Idempotent.
  void Shutdown();

 private:
  struct Published {
    uint64_t sequence = 0;  // number of commands it holds
    std::shared_ptr<const Map> map;
  };

  void Work(std::stop_token stop);
  void Apply(const MapCommand& command);
  void Fail(std::exception_ptr failure);
  std::shared_ptr<const Map> WaitFor(uint64_t sequence);

  RunnerMode mode_;
  int lag_;
  Mapper mapper_;  // of the mapping thread while there is one
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<MapCommand> queue_;
  std::deque<Published>
      published_;  // ascending; the oldest the tracker may still ask for comes first
  std::deque<std::pair<int, uint64_t>>
      submitted_;  // frame and sequence of commands not yet behind the lag
  uint64_t submitted_count_ = 0, applied_count_ = 0, required_ = 0;
  std::exception_ptr failure_;
  std::jthread thread_;
};

}  // namespace oaslam
