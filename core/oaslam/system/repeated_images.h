#pragma once

#include <opencv2/core.hpp>

namespace oaslam {

// Tells an image that the camera has given before: a camera whose driver hangs repeats its last
// image. The noise of a camera that stands still makes each image another one.
class RepeatedImages {
 public:
  // `grey`: the next image. Returns for how long it has been the same, in seconds; 0 for a new one.
  double Add(const cv::Mat& grey, double timestamp);

 private:
  cv::Mat last_;
  double since_ = 0;
};

}  // namespace oaslam
