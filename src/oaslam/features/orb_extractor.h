#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/features/features.h"
#include "oaslam/features/orb_kernels.h"
#include "oaslam/geometry/ideal_image.h"

namespace oaslam {

// The size of the image in which key points are detected: that of the given image; where that has
// many more pixels than `resolution` x 3/4 `resolution`, it is scaled down to this number; a very
// small image is enlarged.
cv::Size WorkingSize(const Camera& camera, int resolution);

// ORB key points (Rublee et al. 2011) over an image pyramid, evenly spread over each level, and
// converted to the ideal image of the camera.
class OrbExtractor {
 public:
  OrbExtractor(const FeaturesConfig& config, const Camera& camera);

  // `grey`: 8-bit, one channel, of the camera's size. `count`: about how many key points. Not
  // const, since buffers are reused.
  Features Extract(const cv::Mat& grey, int count);
  // No key points, with the same pyramid and bounds.
  Features Nothing() const;

 private:
  cv::Mat AtWorkingResolution(const cv::Mat& grey);
  std::vector<int> CountPerLevel(int count) const;
  std::vector<Corner> DetectCorners(const cv::Mat& image);

  FeaturesConfig config_;
  Camera camera_;
  cv::Size working_size_;
  PyramidScales pyramid_;
  IdealImage ideal_image_;
  std::vector<cv::Mat> level_images_;  // of the pyramid; the first may be that of the caller
  cv::Mat working_;
  cv::Mat blurred_;
  std::vector<uint8_t> scores_;
};

}  // namespace oaslam
