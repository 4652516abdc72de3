#include "oaslam/service/worker_pool.h"

#include <boost/asio/post.hpp>
#include <exception>
#include <string>
#include <utility>

#include "oaslam/util/log.h"

namespace oaslam {

void WorkerPool::Finish() {
  {
    const std::scoped_lock lock(mutex_);
    is_finished_ = true;
  }
  threads_.join();
}

bool WorkerPool::TryAdd(Task task) {
  const std::scoped_lock lock(mutex_);
  if (is_finished_ || waiting_ >= most_waiting_) return false;
  ++waiting_;
  boost::asio::post(threads_, [this, task = std::move(task)] {
    --waiting_;
    try {
      task();
    } catch (const std::exception& error) {
      Log(LogLevel::kWarning, std::string("a task of the service: ") + error.what());
    }
  });
  return true;
}

}  // namespace oaslam
