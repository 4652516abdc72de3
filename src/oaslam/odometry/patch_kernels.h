#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace oaslam {

// The inner loops of the search of patches (odometry/patch_flow), compiled for each instruction set
// and chosen at run time (Highway). All arithmetic is in integers, so that all give the same bits.

inline constexpr int kPatchSide = 16;
inline constexpr int kPatchRim = kPatchSide + 2;  // with a pixel on each side, for its derivatives
inline constexpr int kPatchWeightBits = 14;       // of bilinear weights
inline constexpr int kPatchGreyBits = 5;  // fractional bits of an interpolated pixel: fits 16 bits

using Patch = std::array<int16_t, kPatchSide * kPatchSide>;
using WidePatch = std::array<int16_t, kPatchRim * kPatchRim>;

// Of the four pixels around a place; their sum is 1 << kPatchWeightBits.
struct BilinearWeights {
  int w00 = 0, w01 = 0, w10 = 0, w11 = 0;
};

// Squares of interpolated pixels whose first lies between `from` and its right and lower
// neighbours.
void SamplePatch(const uint8_t* from, std::ptrdiff_t step, const BilinearWeights& weights,
                 Patch& out);
void SampleWidePatch(const uint8_t* from, std::ptrdiff_t step, const BilinearWeights& weights,
                     WidePatch& out);

// The inner pixels with Scharr's derivatives, which are twice the slopes, and the sums over these.
struct PatchDerivatives {
  Patch grey, dx, dy;
  int64_t sum_x = 0, sum_y = 0, xx = 0, xy = 0, yy = 0;
};
void Differentiate(const WidePatch& wide, PatchDerivatives& out);

// Sums over the differences of another patch from this one, and of their products with its
// derivatives.
struct PatchDifference {
  int64_t sum = 0, by_x = 0, by_y = 0;
};
PatchDifference Compare(const PatchDerivatives& patch, const Patch& other);

}  // namespace oaslam
