#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace oaslam {

// Threads that carry out tasks in the order in which they come, of which a bounded number waits.
class WorkerPool {
 public:
  using Task = std::function<void()>;  // an exception is a warning

  WorkerPool(size_t threads, size_t most_waiting);
  ~WorkerPool() { Finish(); }

  // Carries out what waits, and ends the threads. Called by one thread at a time, and by none of
  // the pool.
  void Finish();

  // False, and the task is dropped, where too many wait already, or the pool has finished.
  bool TryAdd(Task task);
  size_t size() const { return size_; }
  size_t waiting() const;

 private:
  void Run(const std::stop_token& stop);

  const size_t size_, most_waiting_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Task> tasks_;             // guarded by mutex_
  bool is_finished_ = false;           // guarded by mutex_
  std::vector<std::jthread> threads_;  // last member: they start when all others are constructed
};

}  // namespace oaslam
