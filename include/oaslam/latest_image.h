#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "oaslam/export.h"
#include "oaslam/image_source.h"

namespace oaslam {

// Reads a live source on a thread of its own and returns its newest image: a caller that is slower
// than the camera misses images, but never gets an old one.
class OASLAM_API LatestImageSource : public ImageSource {
 public:
  // Begins to read.
  explicit LatestImageSource(std::unique_ptr<ImageSource> source);
  // Stops the source, and waits until the present read ends.
  ~LatestImageSource() override;

  // Waits for an image that was not returned yet; returns nothing once the source has ended.
  // Rethrows exceptions of the source.
  std::optional<InputImage> Next() override;
  // That of the source.
  int size() const override { return source_->size(); }
  // The number of images that were replaced by newer ones before they were returned.
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
  std::jthread thread_;  // last member: the thread starts when all others are constructed
};

}  // namespace oaslam
