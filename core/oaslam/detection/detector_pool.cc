#include "oaslam/detection/detector_pool.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "oaslam/util/check.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {

DetectorPool::DetectorPool(std::vector<Detect> detectors) {
  OASLAM_CHECK(!detectors.empty());
  for (Detect& detect : detectors)
    threads_.emplace_back(
        [this, detect = std::move(detect)](const std::stop_token& stop) { Run(stop, detect); });
}

DetectorPool::~DetectorPool() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
}

std::future<std::vector<Detection>> DetectorPool::Add(const cv::Mat& image) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back({image, {}});
  changed_.notify_one();
  return waiting_.back().found.get_future();
}

size_t DetectorPool::MostAhead(const cv::Mat& image) const {
  // Images that wait: enough that no thread idles, within a bound of memory.
  constexpr size_t kForEachThread = 4, kMostBytes = size_t{256} << 20;
  const size_t bytes = std::max(image.total() * image.elemSize(), size_t{1});
  return std::clamp(kMostBytes / bytes, size_t{1}, kForEachThread * threads_.size());
}

void DetectorPool::Run(const std::stop_token& stop, const Detect& detect) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !waiting_.empty(); })) {
    if (stop.stop_requested()) return;
    Work work = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    const Stopwatch watch;
    std::vector<Detection> found;
    std::exception_ptr failure;
    try {
      found = detect(work.image);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    ++images_;
    busy_ms_ += watch.WallMs();
    // Last, so that the image is counted once its detections are there.
    if (failure)
      work.found.set_exception(failure);
    else
      work.found.set_value(std::move(found));
  }
}

int DetectorPool::images() const {
  const std::lock_guard lock(mutex_);
  return images_;
}

double DetectorPool::busy_ms() const {
  const std::lock_guard lock(mutex_);
  return busy_ms_;
}

}  // namespace oaslam
