#pragma once

#include <opencv2/core.hpp>

#include "oaslam/camera.h"

namespace oaslam {

// Removes the distortion from a camera's images, so that points, boxes and ellipses of the ideal
// image fit them.
class IdealPictureMaker {
 public:
  // `max_side`: the largest side of a picture, pixels; larger images are scaled down.
  explicit IdealPictureMaker(int max_side) : max_side_(max_side) {}

  // The scale of a picture relative to the camera's pixels.
  double ScaleOf(const Camera& camera) const;
  cv::Mat Make(const Camera& camera, const cv::Mat& image);

 private:
  int max_side_;
  Camera camera_;  // the camera for which the tables were made
  cv::Mat map_x_, map_y_;
};

}  // namespace oaslam
