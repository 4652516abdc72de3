#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/types.h"

namespace oaslam {

// Turns images into what the page shows: without distortion, so that points, boxes and ellipses of the ideal image lie
// where they belong, and no larger than need be.
class PictureMaker {
 public:
  static constexpr int kMaxSide = 640;  // pixels

  // Ideal image of the camera, BGR; `scale()` of its pixels are one of the camera's.
  cv::Mat Make(const Camera& camera, const cv::Mat& image);
  static double ScaleOf(const Camera& camera);

 private:
  Camera camera_;  // of the tables
  cv::Mat map_x_, map_y_;
};

std::vector<uint8_t> EncodeJpeg(const cv::Mat& picture, int quality);

// The part of a picture in a box of the ideal image with a margin around it, at most `max_side` pixels; empty where
// there is none.
cv::Mat CutOut(const cv::Mat& picture, double scale, const Box& box, int max_side);

}  // namespace oaslam
