#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/fork.h"
#include "oaslam/types.h"

namespace oaslam {

// Runs a detector on a thread of its own. When the detector is free, it takes the newest offered
// image and drops older ones, so that no caller waits for the detector:
//
//   BackgroundDetector detector([&](const cv::Mat& image) { return network->Detect(image); });
//   const TrackingResult result = slam.Process({image, timestamp, {}, true});
//   detector.Offer(result.frame, image);
//   for (const auto& [frame, detections] : detector.Take()) slam.AddDetections(frame, detections);
class OASLAM_API BackgroundDetector {
 public:
  // From an image to its detections, as Detector::Detect.
  using Detect = std::function<std::vector<Detection>(const cv::Mat&)>;
  // The detections of an image that was offered.
  struct Result {
    int frame = 0;
    std::vector<Detection> detections;
  };

  // `detect` is called on that thread only. Throws InputError where it is empty.
  explicit BackgroundDetector(Detect detect);
  // Waits until the present image is processed.
  ~BackgroundDetector();

  // Offers an image, which replaces one that still waits. Frames ascend. The image is copied: the
  // caller may read the next one into it.
  void Offer(int frame, const cv::Mat& image);
  // The results since the last call, ascending by frame. Rethrows an exception of `detect`.
  std::vector<Result> Take();
  // Waits until the detector is idle: every image that was not replaced has been processed.
  void Wait();
  // Drops the waiting image, all results, and the result of the image being processed. Call it
  // after Slam::Reset or Load, since frames are counted from 0 again. Does not wait.
  void Clear();

  int images() const;      // number of images processed
  double busy_ms() const;  // time spent on them

 private:
  class Impl;
  ProcessBound<Impl> impl_;
};

}  // namespace oaslam
