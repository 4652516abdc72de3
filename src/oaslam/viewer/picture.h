#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/exports/ideal_picture.h"
#include "oaslam/types.h"

namespace oaslam {

// Turns images into what the page shows: ideal ones, no larger than need be.
class PictureMaker {
 public:
  static constexpr int kMaxSide = 640;  // pixels

  // Ideal image of the camera, BGR; `ScaleOf` of its pixels are one of the camera's.
  cv::Mat Make(const Camera& camera, const cv::Mat& image) { return maker_.Make(camera, image); }
  static double ScaleOf(const Camera& camera) {
    return IdealPictureMaker(kMaxSide).ScaleOf(camera);
  }

 private:
  IdealPictureMaker maker_{kMaxSide};
};

std::vector<uint8_t> EncodeJpeg(const cv::Mat& picture, int quality);

// The part of a picture in a box of the ideal image with a margin around it, at most `max_side`
// pixels; empty where there is none.
cv::Mat CutOut(const cv::Mat& picture, double scale, const Box& box, int max_side);

}  // namespace oaslam
