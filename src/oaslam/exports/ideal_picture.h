#pragma once

#include <opencv2/core.hpp>

#include "oaslam/camera.h"

namespace oaslam {

// Makes pictures of a camera's images as they would be without distortion, so that points, boxes
// and ellipses of the ideal image lie where they belong.
class IdealPictureMaker {
 public:
  // `max_side`: of the pictures, pixels; larger images are made smaller.
  explicit IdealPictureMaker(int max_side) : max_side_(max_side) {}

  // BGR; so many of its pixels are one of the camera's.
  double ScaleOf(const Camera& camera) const;
  cv::Mat Make(const Camera& camera, const cv::Mat& image);

 private:
  int max_side_;
  Camera camera_;  // of the tables
  cv::Mat map_x_, map_y_;
};

}  // namespace oaslam
