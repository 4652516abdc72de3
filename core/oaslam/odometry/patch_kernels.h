#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace oaslam {

// The inner loops of the search of patches (odometry/patch_flow), compiled for each instruction set
// and chosen at run time (Highway). All arithmetic is in integers of fixed width, so that all give
// the same bits.

inline constexpr int kPatchSide = 16;
inline constexpr int kPatchRim = kPatchSide + 2;  // with a pixel on each side, for its derivatives
inline constexpr int kPatchGreyBits = 5;          // fractional bits of an interpolated pixel

// A place between the pixels of an image.
struct PatchPlace {
  const uint8_t* pixel = nullptr;  // above and left of the place
  std::ptrdiff_t step = 0;         // from a row of the image to the next
  int16_t right = 0, down = 0;     // fractions of a pixel, in 1 / 32768
};

// The square of kPatchSide interpolated pixels with Scharr's derivatives, which are twice the
// slopes, and the sums over these.
struct DerivedPatch {
  std::array<int16_t, kPatchSide * kPatchSide> grey, dx, dy;
  int64_t sum_x = 0, sum_y = 0, xx = 0, xy = 0, yy = 0;
};
// `first` is the place of the first pixel of the rim.
void DerivePatch(const PatchPlace& first, DerivedPatch& out);

// Sums over the differences of the square at `first` from a patch, and of their products with the
// patch's derivatives.
struct PatchDifference {
  int64_t sum = 0, by_x = 0, by_y = 0;
};
PatchDifference ComparePatch(const DerivedPatch& patch, const PatchPlace& first);

}  // namespace oaslam
