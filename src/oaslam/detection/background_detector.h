#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// A detector on a thread of its own, at its own pace: of the images offered it takes the newest
// whenever it is free. Nobody waits for it.
class BackgroundDetector {
 public:
  using Detect = std::function<std::vector<Detection>(const cv::Mat&)>;
  struct Result {
    int frame = 0;
    std::vector<Detection> detections;
  };

  // `detect` is called on the thread alone.
  explicit BackgroundDetector(Detect detect);
  // Waits for the image under way.
  ~BackgroundDetector();

  // Replaces the image that waits, if one does. Frames ascend.
  void Offer(int frame, const cv::Mat& image);
  // What was found since the last call, by ascending frame. Rethrows what `detect` threw.
  std::vector<Result> Take();
  // Waits until the detector is idle: all that was not replaced has been looked at.
  void Wait();

  int images() const;      // looked at so far
  double busy_ms() const;  // spent on them

 private:
  struct Work {
    int frame = 0;
    cv::Mat image;
  };
  void Run(const std::stop_token& stop);

  Detect detect_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Work> waiting_;  // guarded, as what follows
  bool is_busy_ = false;
  std::vector<Result> results_;
  std::exception_ptr failure_;
  int images_ = 0;
  double busy_ms_ = 0;
  std::jthread thread_;  // last: begins when all else is there
};

}  // namespace oaslam
