#include "oaslam/service/worker_pool.h"

#include <exception>
#include <string>
#include <utility>

#include "oaslam/util/log.h"

namespace oaslam {

WorkerPool::WorkerPool(size_t threads, size_t most_waiting)
    : size_(threads), most_waiting_(most_waiting) {
  for (size_t i = 0; i < threads; ++i)
    threads_.emplace_back([this](const std::stop_token& stop) { Run(stop); });
}

void WorkerPool::Finish() {
  {
    const std::scoped_lock lock(mutex_);
    is_finished_ = true;
  }
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();  // joins
}

bool WorkerPool::TryAdd(Task task) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_finished_ || tasks_.size() >= most_waiting_) return false;
    tasks_.push_back(std::move(task));
  }
  changed_.notify_one();
  return true;
}

size_t WorkerPool::waiting() const {
  const std::scoped_lock lock(mutex_);
  return tasks_.size();
}

void WorkerPool::Run(const std::stop_token& stop) {
  while (true) {
    Task task;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [&] { return !tasks_.empty(); });
      if (tasks_.empty()) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    try {
      task();
    } catch (const std::exception& error) {
      Log(LogLevel::kWarning, std::string("a task of the service: ") + error.what());
    }
  }
}

}  // namespace oaslam
