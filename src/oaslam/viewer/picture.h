#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/exports/ideal_picture.h"
#include "oaslam/types.h"

namespace oaslam {

// Converts images to pictures for the page: ideal images of limited size.
class PictureMaker {
 public:
  static constexpr int kMaxSide = 640;  // pixels, about as wide as the page shows it

  // The ideal image of the camera, BGR, scaled by `ScaleOf` relative to the camera's pixels.
  cv::Mat Make(const Camera& camera, const cv::Mat& image) { return maker_.Make(camera, image); }
  static double ScaleOf(const Camera& camera) {
    return IdealPictureMaker(kMaxSide).ScaleOf(camera);
  }

 private:
  IdealPictureMaker maker_{kMaxSide};
};

std::vector<uint8_t> EncodeJpeg(const cv::Mat& picture, int quality);

// Cuts out a box of the ideal image with a margin around it, at most `max_side` pixels large; empty
// where nothing is left.
cv::Mat CutOut(const cv::Mat& picture, double scale, const Box& box, int max_side);

}  // namespace oaslam
