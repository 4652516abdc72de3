#pragma once

#include <atomic>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <mutex>

namespace oaslam {

// A thread pool of Asio whose queue is bounded. Tasks begin in the order in which they come.
class WorkerPool {
 public:
  using Task = std::function<void()>;  // an exception is a warning

  WorkerPool(size_t threads, size_t most_waiting)
      : size_(threads), most_waiting_(most_waiting), threads_(threads) {}
  ~WorkerPool() { Finish(); }

  // Carries out what waits, and ends the threads. Called by one thread at a time, and by none of
  // the pool.
  void Finish();

  // False, and the task is dropped, where too many wait already, or the pool has finished.
  bool TryAdd(Task task);
  size_t size() const { return size_; }
  size_t waiting() const { return waiting_; }

 private:
  const size_t size_, most_waiting_;
  std::mutex mutex_;
  bool is_finished_ = false;  // guarded by mutex_
  std::atomic<size_t> waiting_ = 0;
  boost::asio::thread_pool threads_;  // last member: its tasks use the others
};

}  // namespace oaslam
