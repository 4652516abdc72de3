#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "oaslam/images/image_source.h"

namespace oaslam {

// Reads a live source on a thread of its own and gives out its newest image: whoever is slower than
// the camera misses images, but never sees an old one.
class LatestImageSource : public ImageSource {
 public:
  explicit LatestImageSource(std::unique_ptr<ImageSource> source);
  // Stops the source, and waits for the read under way to end.
  ~LatestImageSource() override;

  // Waits for an image that was not given out yet; nothing once the source has ended. Rethrows what
  // the source threw.
  std::optional<InputImage> Next() override;
  int size() const override { return source_->size(); }
  // Images that newer ones replaced before they were asked for.
  int dropped() const { return dropped_; }

 private:
  void Capture(const std::stop_token& stop);

  std::unique_ptr<ImageSource> source_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<InputImage> newest_;  // guarded, as the next two
  bool has_ended_ = false;
  std::exception_ptr failure_;
  std::atomic<int> dropped_ = 0;
  std::jthread thread_;  // last: begins when all else is there
};

}  // namespace oaslam
