#include "oaslam/latest_image.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "oaslam/error.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/playback_clock.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

// Leaves out what cannot be read, and plays a recording at the speed of its time stamps.
class PlayedSource : public ImageSource {
 public:
  PlayedSource(std::unique_ptr<ImageSource> source, bool is_recording)
      : source_(std::move(source)), is_recording_(is_recording) {}

  std::optional<InputImage> Next() override {
    std::optional<InputImage> image = source_->Next();
    for (; image && image->image.empty(); image = source_->Next())
      Log(LogLevel::kWarning, "{}: cannot be read, left out", image->name);
    if (image && is_recording_) WaitUntilItIsTime(*image);
    return image;
  }
  int size() const override { return source_->size(); }
  void Stop() override {
    {
      const std::lock_guard lock(mutex_);
      is_stopped_ = true;
    }
    changed_.notify_all();
    source_->Stop();
  }

 private:
  void WaitUntilItIsTime(InputImage& image) {
    const double now = SteadySeconds();
    image.taken_s = playback_.Due(image.timestamp, now);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(*image.taken_s - now),
                      [this] { return is_stopped_; });
  }

  std::unique_ptr<ImageSource> source_;
  bool is_recording_;
  PlaybackClock playback_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopped_ = false;  // guarded by the mutex
};

}  // namespace

class OASLAM_LOCAL LatestImageSource::Impl {
 public:
  explicit Impl(std::unique_ptr<ImageSource> source)
      : source_(std::move(source)),
        thread_([this](const std::stop_token& stop) { Capture(stop); }) {}
  ~Impl() { Stop(); }

  std::optional<InputImage> Next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return newest_ || has_ended_; });
    if (newest_) return std::exchange(newest_, std::nullopt);
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return std::nullopt;
  }

  void Stop() {
    thread_.request_stop();
    End(nullptr);
    {
      const std::lock_guard lock(mutex_);
      newest_.reset();
      if (std::exchange(is_stopped_, true)) return;
    }
    // Else the thread might wait forever for an image, and the destructor for the thread.
    source_->Stop();
  }

  int size() const { return source_->size(); }
  int dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  void Capture(const std::stop_token& stop) {
    std::exception_ptr failure;
    try {
      while (std::optional<InputImage> image = source_->Next())
        if (!Keep(*std::move(image), stop)) break;
    } catch (...) {
      failure = std::current_exception();
    }
    End(failure);
  }

  // Returns false once the source was stopped.
  bool Keep(InputImage image, const std::stop_token& stop) {
    {
      const std::lock_guard lock(mutex_);
      if (stop.stop_requested()) return false;
      if (newest_) ++dropped_;
      newest_ = std::move(image);
    }
    changed_.notify_all();
    return true;
  }

  // Only the first end counts: an exception that a source throws because it was stopped is dropped.
  void End(std::exception_ptr failure) {
    {
      const std::lock_guard lock(mutex_);
      if (!has_ended_) failure_ = std::move(failure);
      has_ended_ = true;
    }
    changed_.notify_all();
  }

  std::unique_ptr<ImageSource> source_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<InputImage> newest_;  // guarded by the mutex, as are the next four
  bool has_ended_ = false, is_stopped_ = false;
  std::exception_ptr failure_;
  int dropped_ = 0;
  std::jthread thread_;  // last member: the thread starts when all others are constructed
};

LatestImageSource::LatestImageSource(std::unique_ptr<ImageSource> source) {
  if (!source) throw InputError("latest image: there is no source to read");
  impl_ = std::make_unique<Impl>(std::move(source));
}
LatestImageSource::~LatestImageSource() = default;

std::optional<InputImage> LatestImageSource::Next() { return impl_->Next(); }
int LatestImageSource::size() const { return impl_->size(); }
void LatestImageSource::Stop() {
  if (impl_.IsHere()) impl_->Stop();
}
int LatestImageSource::dropped() const { return impl_->dropped(); }

std::unique_ptr<LatestImageSource> OpenCamera(const std::string& source,
                                              const ImageSourceOptions& options) {
  const bool is_recording = !IsCamera(source) && !options.follow;
  return std::make_unique<LatestImageSource>(
      std::make_unique<PlayedSource>(OpenImages(source, options), is_recording));
}

}  // namespace oaslam
