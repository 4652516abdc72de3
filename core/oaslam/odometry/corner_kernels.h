#pragma once

#include <cstdint>
#include <vector>

#include "oaslam/features/grey_image.h"

namespace oaslam {

// The inner loops of the search for corners (odometry/corners), compiled for each instruction set
// and chosen at run time (Highway). All give the same bits: sums are of integers, and the rest is
// free of fused multiply-add.

// Pixels [x1, x2) x [y1, y2) of an image.
struct ImageArea {
  int x1 = 0, y1 = 0, x2 = 0, y2 = 0;
  int width() const { return x2 - x1; }
  int height() const { return y2 - y1; }
};

// The structure tensor of a pixel sums over a square with sides of 2 * kCornerBlock + 1 pixels.
inline constexpr int kCornerBlock = 2;

// What CornerStrengths needs besides its result; kept by the caller, so that it is allocated once.
struct CornerScratch {
  std::vector<uint8_t> pixels;
  std::vector<int16_t> smooth, slope;
  std::vector<int32_t> products, rows, columns;
};

// The weaker eigenvalue of the structure tensor at each pixel of an area that is at least
// kCornerBlock + 1 pixels away from the edges of the image, in squared grey levels per px; row by
// row.
void CornerStrengths(const GreyImage& image, const ImageArea& area, CornerScratch& scratch,
                     std::vector<float>& strengths);

// The index of the first of the largest values; there must be one.
int IndexOfLargest(const std::vector<float>& values);

}  // namespace oaslam
