#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "oaslam/types.h"

namespace oaslam {

// An image fitted into the input of a network, its shape kept, the rest filled with grey 114.
struct Letterbox {
  cv::Mat image;             // three channels
  double scale = 1;          // network pixels per image pixel
  double left = 0, top = 0;  // padding, network pixels
};

// `centered`: padding on both sides (YOLOv5 and later) or at the right and bottom only (YOLOX).
Letterbox MakeLetterbox(const cv::Mat& bgr, const cv::Size& network_size, bool centered);

// A box in network pixels, in pixels of the image, clipped to it.
Box FromLetterbox(const Letterbox& letterbox, const Box& box, const cv::Size& image_size);

// An ellipse [cx, cy, width, height, theta] likewise, not clipped.
std::array<double, 5> FromLetterbox(const Letterbox& letterbox,
                                    const std::array<double, 5>& ellipse);

}  // namespace oaslam
