#include "oaslam/background_detector.h"

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "oaslam/error.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {

class OASLAM_LOCAL BackgroundDetector::Impl {
 public:
  explicit Impl(Detect detect)
      : detect_(std::move(detect)), thread_([this](const std::stop_token& stop) { Run(stop); }) {}

  void Offer(int frame, const cv::Mat& image) {
    Work work{frame, image.clone()};
    {
      const std::lock_guard lock(mutex_);
      waiting_ = std::move(work);
    }
    changed_.notify_all();
  }

  std::vector<Result> Take() {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return std::exchange(results_, {});
  }

  void Wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_ && !is_busy_; });
  }

  void Clear() {
    {
      const std::lock_guard lock(mutex_);
      waiting_.reset();
      results_.clear();
      failure_ = nullptr;
      ++generation_;
    }
    changed_.notify_all();
  }

  int images() const {
    const std::lock_guard lock(mutex_);
    return images_;
  }
  double busy_ms() const {
    const std::lock_guard lock(mutex_);
    return busy_ms_;
  }

 private:
  struct Work {
    int frame = 0;
    cv::Mat image;
  };

  void Run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return waiting_.has_value(); })) {
      const Work work = *std::exchange(waiting_, std::nullopt);
      const uint64_t generation = generation_;
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
      if (generation != generation_) {
        // It was forgotten meanwhile.
      } else if (failure) {
        failure_ = failure;
      } else {
        results_.push_back(std::move(result));
      }
      changed_.notify_all();
      if (stop.stop_requested()) return;
    }
  }

  Detect detect_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Work> waiting_;  // this and the following members are guarded by mutex_
  bool is_busy_ = false;
  std::vector<Result> results_;
  std::exception_ptr failure_;
  int images_ = 0;
  double busy_ms_ = 0;
  uint64_t generation_ = 0;  // counts calls of Clear
  std::jthread thread_;      // last member: the thread starts when all others are constructed
};

BackgroundDetector::BackgroundDetector(Detect detect) {
  if (!detect) throw InputError("background detector: there is no function that detects");
  impl_ = std::make_unique<Impl>(std::move(detect));
}
BackgroundDetector::~BackgroundDetector() = default;  // the thread is asked to stop, and joined

void BackgroundDetector::Offer(int frame, const cv::Mat& image) { impl_->Offer(frame, image); }
std::vector<BackgroundDetector::Result> BackgroundDetector::Take() { return impl_->Take(); }
void BackgroundDetector::Wait() { impl_->Wait(); }
void BackgroundDetector::Clear() { impl_->Clear(); }
int BackgroundDetector::images() const { return impl_->images(); }
double BackgroundDetector::busy_ms() const { return impl_->busy_ms(); }

}  // namespace oaslam
