#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "oaslam/types.h"

namespace oaslam {

// An image scaled to fit into the input of a network, with its aspect ratio; the rest is grey 114.
struct Letterbox {
  cv::Mat image;             // three channels
  double scale = 1;          // network pixels per image pixel
  double left = 0, top = 0;  // padding, network pixels
};

// `centered`: padding on both sides (YOLOv5 and later) or at the right and bottom only (YOLOX).
Letterbox MakeLetterbox(const cv::Mat& bgr, const cv::Size& network_size, bool centered);

// Converts a box from network pixels to pixels of the image, clipped to it.
Box FromLetterbox(const Letterbox& letterbox, const Box& box, const cv::Size& image_size);

// Converts an ellipse [cx, cy, width, height, theta] likewise, without clipping.
std::array<double, 5> FromLetterbox(const Letterbox& letterbox,
                                    const std::array<double, 5>& ellipse);

}  // namespace oaslam
