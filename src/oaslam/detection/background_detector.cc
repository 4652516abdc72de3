#include "oaslam/background_detector.h"

#include <utility>

#include "oaslam/util/stopwatch.h"

namespace oaslam {

BackgroundDetector::BackgroundDetector(Detect detect)
    : detect_(std::move(detect)), thread_([this](const std::stop_token& stop) { Run(stop); }) {}

BackgroundDetector::~BackgroundDetector() = default;  // the thread is asked to stop, and joined

void BackgroundDetector::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return waiting_.has_value(); })) {
    const Work work = *std::exchange(waiting_, std::nullopt);
    is_busy_ = true;
    lock.unlock();
    Result result{work.frame, {}};
    std::exception_ptr failure;
    const Stopwatch watch;
    try {
      result.detections = detect_(work.image);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    is_busy_ = false;
    busy_ms_ += watch.WallMs();
    ++images_;
    if (failure)
      failure_ = failure;
    else
      results_.push_back(std::move(result));
    changed_.notify_all();
    if (stop.stop_requested()) return;
  }
}

void BackgroundDetector::Offer(int frame, const cv::Mat& image) {
  Work work{frame, image.clone()};
  {
    const std::lock_guard lock(mutex_);
    waiting_ = std::move(work);
  }
  changed_.notify_all();
}

std::vector<BackgroundDetector::Result> BackgroundDetector::Take() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  return std::exchange(results_, {});
}

void BackgroundDetector::Wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !waiting_ && !is_busy_; });
}

int BackgroundDetector::images() const {
  const std::lock_guard lock(mutex_);
  return images_;
}

double BackgroundDetector::busy_ms() const {
  const std::lock_guard lock(mutex_);
  return busy_ms_;
}

}  // namespace oaslam
