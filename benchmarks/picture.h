#pragma once

#include <opencv2/imgproc.hpp>

#include "oaslam/util/rng.h"

namespace oaslam {

// Rectangles of random places and greys, 640 x 480.
inline cv::Mat Rectangles(Rng& rng) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(90));
  for (int i = 0; i < 600; ++i)
    cv::rectangle(image,
                  cv::Rect(rng.Index(620), rng.Index(460), 8 + rng.Index(40), 8 + rng.Index(40)),
                  cv::Scalar(rng.Index(256)), -1);
  return image;
}

}  // namespace oaslam
