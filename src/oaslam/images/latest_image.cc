#include "oaslam/latest_image.h"

#include <utility>

namespace oaslam {

LatestImageSource::LatestImageSource(std::unique_ptr<ImageSource> source)
    : source_(std::move(source)), thread_([this](const std::stop_token& stop) { Capture(stop); }) {}

LatestImageSource::~LatestImageSource() {
  thread_.request_stop();
  // Otherwise the thread, which is joined now, might wait for an image that never comes.
  source_->Stop();
}

void LatestImageSource::Capture(const std::stop_token& stop) {
  std::exception_ptr failure;
  try {
    while (!stop.stop_requested()) {
      std::optional<InputImage> image = source_->Next();
      if (!image) break;
      {
        const std::lock_guard lock(mutex_);
        if (newest_) ++dropped_;
        newest_ = std::move(image);
      }
      changed_.notify_one();
    }
  } catch (...) {
    failure = std::current_exception();
  }
  {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
    failure_ = failure;
  }
  changed_.notify_one();
}

std::optional<InputImage> LatestImageSource::Next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return newest_ || has_ended_; });
  if (newest_) return std::exchange(newest_, std::nullopt);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  return std::nullopt;
}

}  // namespace oaslam
