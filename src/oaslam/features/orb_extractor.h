#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/features/features.h"
#include "oaslam/features/orb_kernels.h"
#include "oaslam/geometry/ideal_image.h"

namespace oaslam {

// ORB key points (Rublee et al. 2011) over an image pyramid, evenly spread over each level, and brought into the ideal image of
// the camera.
class OrbExtractor {
 public:
  OrbExtractor(const FeaturesConfig& config, const Camera& camera);

  // `grey`: 8-bit, one channel, of the camera's size. `count`: about how many key points. Not const only because it keeps its buffers.
  Features Extract(const cv::Mat& grey, int count);

 private:
  std::vector<int> CountPerLevel(int count) const;
  std::vector<Corner> DetectCorners(const cv::Mat& image);

  FeaturesConfig config_;
  Camera camera_;
  PyramidScales pyramid_;
  IdealImage ideal_image_;
  std::vector<cv::Mat> level_images_;  // of the pyramid; the first is that of the caller
  cv::Mat blurred_;
  std::vector<uint8_t> scores_;
};

}  // namespace oaslam
