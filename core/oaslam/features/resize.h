#pragma once

#include "oaslam/features/grey_image.h"

namespace oaslam {

// The functions below scale an image to the size of `resized`, edge to edge. Every processor gives
// the same bits, since these functions use integers, or floats without fused multiply-add.

// Interpolates linearly between the four nearest pixels. Where it scales down, the bits are those
// of OpenCV's INTER_LINEAR; where it scales down by more than 2, it skips pixels. Both sizes are at
// least 16 x 16.
void ResizeLinear(const GreyImage& image, GreyBuffer& resized);

// Scales down: each pixel is the mean of the area that it covers.
void ResizeByArea(const GreyImage& image, GreyBuffer& resized);

// Interpolates by cubic convolution (Keys 1981), which keeps edges sharper where it scales up. The
// image has at least 4 x 4 pixels.
void ResizeCubic(const GreyImage& image, GreyBuffer& resized);

}  // namespace oaslam
