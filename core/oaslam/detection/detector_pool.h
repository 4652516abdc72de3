#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <opencv2/core.hpp>
#include <thread>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// Runs detectors on threads of their own, one on each: several images are worked on at a time,
// begun in the order in which they were given. What is found in an image does not depend on the
// others, nor on the number of threads.
class DetectorPool {
 public:
  using Detect = std::function<std::vector<Detection>(const cv::Mat&)>;

  // `detectors` has one function for each thread, at least one; a thread calls only its own
  // function.
  explicit DetectorPool(std::vector<Detect> detectors);
  // Images that wait are given up: their futures are broken promises.
  ~DetectorPool();

  // The detections of an image, once they are ready; the future rethrows what the detector throws.
  // The image must not be changed meanwhile.
  std::future<std::vector<Detection>> Add(const cv::Mat& image);

  // How many images of this size a caller should add ahead of the image whose result it waits for:
  // four for each thread, which keeps all threads busy, but at most 256 MiB of images, and at least
  // one.
  size_t MostAhead(const cv::Mat& image) const;

  int images() const;      // number of images processed
  double busy_ms() const;  // time spent on them, of all threads

 private:
  struct Work {
    cv::Mat image;
    std::promise<std::vector<Detection>> found;
  };
  void Run(const std::stop_token& stop, const Detect& detect);

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Work> waiting_;  // this and the following members are guarded by mutex_
  int images_ = 0;
  double busy_ms_ = 0;
  std::vector<std::jthread> threads_;  // last member: they start when all others are constructed
};

}  // namespace oaslam
