#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/types.h"

namespace oaslam {

// Runs a detector on a thread of its own, at its own speed: whenever it is free it takes the newest
// image offered. Nothing waits for it.
class OASLAM_API BackgroundDetector {
 public:
  using Detect = std::function<std::vector<Detection>(const cv::Mat&)>;
  struct Result {
    int frame = 0;
    std::vector<Detection> detections;
  };

  // `detect` is called on that thread only.
  explicit BackgroundDetector(Detect detect);
  // Waits until the present image is processed.
  ~BackgroundDetector();

  // Offers an image, which replaces one that still waits. Frames ascend. The image is kept and not
  // copied: clone a view of memory that changes.
  void Offer(int frame, const cv::Mat& image);
  // The results since the last call, ascending by frame. Rethrows an exception of `detect`.
  std::vector<Result> Take();
  // Waits until the detector is idle: every image that was not replaced has been processed.
  void Wait();

  int images() const;      // number of images processed
  double busy_ms() const;  // time spent on them

 private:
  struct Work {
    int frame = 0;
    cv::Mat image;
  };
  void Run(const std::stop_token& stop);

  Detect detect_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Work> waiting_;  // this and the following members are guarded by mutex_
  bool is_busy_ = false;
  std::vector<Result> results_;
  std::exception_ptr failure_;
  int images_ = 0;
  double busy_ms_ = 0;
  std::jthread thread_;  // last member: the thread starts when all others are constructed
};

}  // namespace oaslam
