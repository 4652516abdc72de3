#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "oaslam/types.h"

namespace oaslam {

// How an image is brought to the size of a network's input: with its aspect ratio and grey 114 at
// the right and the bottom (YOLOX) or on both sides (YOLOv5 and later), or stretched (RT-DETR).
enum class Fit { kTopLeft, kCentered, kStretched };

struct Letterbox {
  cv::Mat image;                    // three channels
  double scale_x = 1, scale_y = 1;  // network pixels per image pixel
  double left = 0, top = 0;         // padding, network pixels
};

Letterbox MakeLetterbox(const cv::Mat& bgr, const cv::Size& network_size, Fit fit);

// Converts a box from network pixels to pixels of the image, clipped to it.
Box FromLetterbox(const Letterbox& letterbox, const Box& box, const cv::Size& image_size);

// Converts an ellipse [cx, cy, width, height, theta] likewise, without clipping. Not of a stretched
// image.
std::array<double, 5> FromLetterbox(const Letterbox& letterbox,
                                    const std::array<double, 5>& ellipse);

}  // namespace oaslam
