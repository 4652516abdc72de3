#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "oaslam/features/features.h"
#include "oaslam/features/grey_image.h"

namespace oaslam {

// The pixel kernels of ORB, in the widest vectors of the processor (Highway, chosen at run time).
// All arithmetic is on integers, so that every processor gives the same bits. `step` is the
// distance of rows in bytes.

constexpr int kMinKernelWidth = 40;  // least width of the images for these functions
constexpr int kFastRing = 3;  // radius of FAST's circle: no corners are found nearer to the border
constexpr int kPatchRadius = 15;   // of PatchMoments
constexpr int kPatternReach = 19;  // of Describe: 13 * sqrt(2), rounded up

struct Corner {
  int32_t x = 0, y = 0;
  uint8_t score = 0;
  // Subpixel offset to the vertex of the parabolas through the scores, within half a pixel.
  float dx = 0, dy = 0;
};

// FAST-9-16 (Rosten and Drummond 2006): corners with a score above `threshold`, local maxima of the
// score among their eight neighbours, row by row. The score of a pixel is the largest t such that
// nine consecutive pixels of its circle are all brighter than it by at least t, or all darker.
// `scores`: scratch.
std::vector<Corner> DetectFast(const GreyImage& image, uint8_t threshold,
                               std::vector<uint8_t>& scores);

// Gaussian of 7 x 7, sigma 2, mirrored at the border without repeating the outermost pixel.
// `blurred`: as large as the image.
void BlurGaussian7(const GreyImage& image, uint8_t* blurred, std::ptrdiff_t blurred_step);

// Sums of u I(u, v) and of v I(u, v) over the disc of radius kPatchRadius; reads one column to the
// right of it.
struct Moments {
  int x = 0, y = 0;
};
Moments PatchMoments(const uint8_t* center, std::ptrdiff_t step);

// The direction of the moments in units of 1/1024; (1024, 0) for none.
struct PatchDirection {
  int16_t cos = 1024, sin = 0;
};
PatchDirection DirectionOf(const Moments& moments);

// Steered BRIEF of the blurred image: ORB's 256 comparisons, the pattern rotated by `direction`
// (Rublee et al. 2011).
Descriptor Describe(const uint8_t* center, std::ptrdiff_t step, const PatchDirection& direction);

// ORB's pattern: pair i compares point i with point 256 + i.
struct OrbPattern {
  alignas(64) std::array<int16_t, 512> x, y;
};
const OrbPattern& GetOrbPattern();

// Half width of the disc of kPatchRadius at each distance from its middle row.
const std::array<int, kPatchRadius + 1>& DiscHalfWidths();

}  // namespace oaslam
