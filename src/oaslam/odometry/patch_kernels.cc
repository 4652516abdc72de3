#include "oaslam/odometry/patch_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/odometry/patch_kernels.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Plain loops, which the compiler turns into vectors of each instruction set.
HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {

template <int side>
HWY_INLINE void Sample(const uint8_t* from, std::ptrdiff_t step, const BilinearWeights& w,
                       int16_t* out) {
  constexpr int shift = kPatchWeightBits - kPatchGreyBits, half = 1 << (shift - 1);
  for (int r = 0; r < side; ++r) {
    const uint8_t* a = from + r * step;
    const uint8_t* b = a + step;
    for (int c = 0; c < side; ++c)
      out[r * side + c] = static_cast<int16_t>(
          (a[c] * w.w00 + a[c + 1] * w.w01 + b[c] * w.w10 + b[c + 1] * w.w11 + half) >> shift);
  }
}

void SampleInner(const uint8_t* from, std::ptrdiff_t step, const BilinearWeights& weights,
                 int16_t* out) {
  Sample<kPatchSide>(from, step, weights, out);
}

void SampleWide(const uint8_t* from, std::ptrdiff_t step, const BilinearWeights& weights,
                int16_t* out) {
  Sample<kPatchRim>(from, step, weights, out);
}

void DifferentiateRows(const int16_t* wide, int16_t* grey, int16_t* dx, int16_t* dy,
                       int64_t* sums) {
  for (int k = 0; k < 5; ++k) sums[k] = 0;
  for (int r = 0; r < kPatchSide; ++r) {
    const int16_t* p = wide + r * kPatchRim;
    const int16_t *q = p + kPatchRim, *s = q + kPatchRim;
    int16_t *x = dx + r * kPatchSide, *y = dy + r * kPatchSide;
    int32_t row_x = 0, row_y = 0, row_xx = 0, row_xy = 0, row_yy = 0;
    for (int c = 0; c < kPatchSide; ++c) {
      const int gx = (3 * (p[c + 2] - p[c] + s[c + 2] - s[c]) + 10 * (q[c + 2] - q[c])) >> 4;
      const int gy = (3 * (s[c] - p[c] + s[c + 2] - p[c + 2]) + 10 * (s[c + 1] - p[c + 1])) >> 4;
      grey[r * kPatchSide + c] = q[c + 1];
      x[c] = static_cast<int16_t>(gx);
      y[c] = static_cast<int16_t>(gy);
    }
    for (int c = 0; c < kPatchSide; ++c) {
      row_x += x[c];
      row_y += y[c];
      row_xx += x[c] * x[c];
      row_xy += x[c] * y[c];
      row_yy += y[c] * y[c];
    }
    sums[0] += row_x;
    sums[1] += row_y;
    sums[2] += row_xx;
    sums[3] += row_xy;
    sums[4] += row_yy;
  }
}

void CompareRows(const int16_t* grey, const int16_t* dx, const int16_t* dy, const int16_t* other,
                 int64_t* sums) {
  for (int k = 0; k < 3; ++k) sums[k] = 0;
  for (int r = 0; r < kPatchSide; ++r) {
    int32_t row = 0, row_x = 0, row_y = 0;
    for (int i = r * kPatchSide; i < (r + 1) * kPatchSide; ++i) {
      const auto difference = static_cast<int16_t>(other[i] - grey[i]);
      row += difference;
      row_x += difference * dx[i];
      row_y += difference * dy[i];
    }
    sums[0] += row;
    sums[1] += row_x;
    sums[2] += row_y;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {

HWY_EXPORT(SampleInner);
HWY_EXPORT(SampleWide);
HWY_EXPORT(DifferentiateRows);
HWY_EXPORT(CompareRows);

void SamplePatch(const uint8_t* from, std::ptrdiff_t step, const BilinearWeights& weights,
                 Patch& out) {
  HWY_DYNAMIC_DISPATCH(SampleInner)(from, step, weights, out.data());
}

void SampleWidePatch(const uint8_t* from, std::ptrdiff_t step, const BilinearWeights& weights,
                     WidePatch& out) {
  HWY_DYNAMIC_DISPATCH(SampleWide)(from, step, weights, out.data());
}

void Differentiate(const WidePatch& wide, PatchDerivatives& out) {
  int64_t sums[5];
  HWY_DYNAMIC_DISPATCH(DifferentiateRows)
  (wide.data(), out.grey.data(), out.dx.data(), out.dy.data(), sums);
  out.sum_x = sums[0];
  out.sum_y = sums[1];
  out.xx = sums[2];
  out.xy = sums[3];
  out.yy = sums[4];
}

PatchDifference Compare(const PatchDerivatives& patch, const Patch& other) {
  int64_t sums[3];
  HWY_DYNAMIC_DISPATCH(CompareRows)
  (patch.grey.data(), patch.dx.data(), patch.dy.data(), other.data(), sums);
  return {sums[0], sums[1], sums[2]};
}

}  // namespace oaslam

#endif  // HWY_ONCE
