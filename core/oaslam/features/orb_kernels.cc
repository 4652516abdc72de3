#include "oaslam/features/orb_kernels.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "oaslam/util/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/features/orb_kernels.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Bytes = hn::CappedTag<uint8_t, 32>;  // rows are at least that wide inside FAST's ring
using ByteVec = hn::Vec<Bytes>;

HWY_INLINE bool AllZero(Bytes d, ByteVec v) { return hn::AllTrue(d, hn::Eq(v, hn::Zero(d))); }

// Computes, from 16 differences around the circle, the maximum over all arcs of nine of the minimum
// in the arc. Arcs that begin at 2k and at 2k + 1 share eight.
HWY_INLINE ByteVec BestArc(Bytes d, const ByteVec (&difference)[16]) {
  ByteVec two[8], four[8];
  for (int k = 0; k < 8; ++k) two[k] = hn::Min(difference[2 * k + 1], difference[(2 * k + 2) % 16]);
  for (int k = 0; k < 8; ++k) four[k] = hn::Min(two[k], two[(k + 1) % 8]);
  ByteVec best = hn::Zero(d);
  for (int k = 0; k < 8; ++k) {
    const ByteVec eight = hn::Min(four[k], four[(k + 2) % 8]);
    best = hn::Max(best, hn::Min(eight, hn::Max(difference[2 * k], difference[(2 * k + 9) % 16])));
  }
  return best;
}

// Scores of one row of pixels, zero where not above the threshold; center has kFastRing pixels on
// each side of the row.
void ScoreRow(const uint8_t* center, std::ptrdiff_t step, int width, uint8_t threshold,
              uint8_t* scores) {
  const Bytes d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const std::ptrdiff_t ring[16] = {3 * step,  3 * step + 1,  2 * step + 2,  step + 3,
                                   3,         -step + 3,     -2 * step + 2, -3 * step + 1,
                                   -3 * step, -3 * step - 1, -2 * step - 2, -step - 3,
                                   -3,        step - 3,      2 * step - 2,  3 * step - 1};
  const ByteVec limit = hn::Set(d, threshold);
  for (int next = 0; next < width; next += lanes) {
    const int x = std::min(next, width - lanes);  // the last vector overlaps the one before
    const uint8_t* p = center + x;
    const ByteVec c = hn::LoadU(d, p);
    // An arc of nine contains at least one pixel of each opposite pair.
    ByteVec bright = hn::Set(d, 255), dark = hn::Zero(d);
    for (int k = 0; k < 8; k += 2) {
      const ByteVec a = hn::LoadU(d, p + ring[k]), b = hn::LoadU(d, p + ring[k + 8]);
      bright = hn::Min(bright, hn::Max(a, b));
      dark = hn::Max(dark, hn::Min(a, b));
    }
    const bool any_bright = !AllZero(d, hn::SaturatedSub(bright, hn::SaturatedAdd(c, limit)));
    const bool any_dark = !AllZero(d, hn::SaturatedSub(hn::SaturatedSub(c, limit), dark));
    ByteVec score = hn::Zero(d);
    ByteVec difference[16];
    if (any_bright) {
      for (int k = 0; k < 16; ++k) difference[k] = hn::SaturatedSub(hn::LoadU(d, p + ring[k]), c);
      score = BestArc(d, difference);
    }
    if (any_dark) {
      for (int k = 0; k < 16; ++k) difference[k] = hn::SaturatedSub(c, hn::LoadU(d, p + ring[k]));
      score = hn::Max(score, BestArc(d, difference));
    }
    const auto weak = hn::Eq(hn::SaturatedSub(score, limit), hn::Zero(d));
    hn::StoreU(hn::IfThenZeroElse(weak, score), d, scores + x);
  }
}

// The position of the vertex of the parabola through three values at -1, 0 and 1, of which the
// middle one is the largest.
float TopOfParabola(int before, int here, int after) {
  return static_cast<float>(after - before) / static_cast<float>(2 * (2 * here - before - after));
}

// Appends the strict local maxima of a row of scores; the row has a pixel on each side.
void AppendMaxima(const uint8_t* scores, std::ptrdiff_t step, int width, int left, int y,
                  std::vector<Corner>& corners) {
  const Bytes d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int next = 0; next < width; next += lanes) {
    const int x = std::min(next, width - lanes);
    const uint8_t* p = scores + x;
    const ByteVec score = hn::LoadU(d, p);
    if (AllZero(d, score)) continue;
    ByteVec around = hn::Max(hn::LoadU(d, p - 1), hn::LoadU(d, p + 1));
    for (int side = -1; side <= 1; ++side)
      around =
          hn::Max(around, hn::Max(hn::LoadU(d, p - step + side), hn::LoadU(d, p + step + side)));
    uint64_t bits = 0;
    hn::StoreMaskBits(d, hn::Ne(hn::SaturatedSub(score, around), hn::Zero(d)),
                      reinterpret_cast<uint8_t*>(&bits));
    for (bits = bits >> (next - x) << (next - x); bits; bits &= bits - 1) {
      const int i = x + std::countr_zero(bits);
      corners.push_back({left + i, y, scores[i],
                         TopOfParabola(scores[i - 1], scores[i], scores[i + 1]),
                         TopOfParabola(scores[i - step], scores[i], scores[i + step])});
    }
  }
}

constexpr uint16_t kWeights[4] = {56, 48, 34, 18};  // of the Gaussian, at 0 to 3 pixels, in 1/256

// Weighted sum of seven rows, in 1/128 grey levels.
void BlurColumns(const uint8_t* const (&rows)[7], int width, uint16_t* sums) {
  const hn::CappedTag<uint16_t, 16> d;
  const hn::Rebind<uint8_t, decltype(d)> d8;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto load = [&](int row, int x)
                        HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(d8, rows[row] + x)); };
  for (int next = 0; next < width; next += lanes) {
    const int x = std::min(next, width - lanes);
    auto sum = hn::Mul(load(3, x), hn::Set(d, kWeights[0]));
    for (int k = 1; k <= 3; ++k)
      sum = hn::Add(sum, hn::Mul(hn::Add(load(3 - k, x), load(3 + k, x)), hn::Set(d, kWeights[k])));
    hn::StoreU(hn::ShiftRight<1>(sum), d, sums + x);
  }
}

// Weighted sum of seven columns of such sums, rounded to grey levels; sums has three values on each
// side.
void BlurRow(const uint16_t* sums, int width, uint8_t* blurred) {
  const hn::CappedTag<uint16_t, 16> d;
  const hn::RebindToSigned<decltype(d)> d_signed;
  const hn::Rebind<uint8_t, decltype(d)> d8;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int next = 0; next < width; next += lanes) {
    const int x = std::min(next, width - lanes);
    const uint16_t* p = sums + x;
    // MulHigh(v / 128 grey, 512 weight) is in 1/256 grey levels.
    const auto weight = [&](int k) HWY_ATTR {
      return hn::Set(d, static_cast<uint16_t>(kWeights[k] * 512));
    };
    auto sum = hn::MulHigh(hn::LoadU(d, p), weight(0));
    for (int k = 1; k <= 3; ++k)
      sum = hn::Add(sum, hn::MulHigh(hn::Add(hn::LoadU(d, p - k), hn::LoadU(d, p + k)), weight(k)));
    const auto grey = hn::ShiftRight<8>(hn::Add(sum, hn::Set(d, 128)));
    hn::StoreU(hn::DemoteTo(d8, hn::BitCast(d_signed, grey)), d8, blurred + x);
  }
}

// Column and row numbers of the 32 columns from -kPatchRadius on, zero outside of the disc, for
// each row.
struct DiscWeights {
  alignas(64) int16_t u[2 * kPatchRadius + 1][32];
  alignas(64) int16_t v[2 * kPatchRadius + 1][32];
};

const DiscWeights& GetDiscWeights() {
  static const DiscWeights weights = [] {
    DiscWeights w{};
    for (int v = -kPatchRadius; v <= kPatchRadius; ++v) {
      const int half = DiscHalfWidths()[std::abs(v)];
      for (int u = -half; u <= half; ++u) {
        w.u[v + kPatchRadius][u + kPatchRadius] = static_cast<int16_t>(u);
        w.v[v + kPatchRadius][u + kPatchRadius] = static_cast<int16_t>(v);
      }
    }
    return w;
  }();
  return weights;
}

Moments SumMoments(const uint8_t* center, std::ptrdiff_t step) {
  static const DiscWeights& weights = GetDiscWeights();
  const hn::CappedTag<int16_t, 16> d;
  const hn::Rebind<uint8_t, decltype(d)> d8;
  const hn::RepartitionToWide<decltype(d)> d32;
  const size_t lanes = hn::Lanes(d);
  auto x0 = hn::Zero(d32), x1 = hn::Zero(d32), y0 = hn::Zero(d32), y1 = hn::Zero(d32);
  for (int row = 0; row <= 2 * kPatchRadius; ++row) {
    const uint8_t* p = center + (row - kPatchRadius) * step - kPatchRadius;
    for (size_t i = 0; i < 32; i += lanes) {
      const auto grey = hn::PromoteTo(d, hn::LoadU(d8, p + i));
      x0 = hn::ReorderWidenMulAccumulate(d32, grey, hn::Load(d, weights.u[row] + i), x0, x1);
      y0 = hn::ReorderWidenMulAccumulate(d32, grey, hn::Load(d, weights.v[row] + i), y0, y1);
    }
  }
  return {hn::GetLane(hn::SumOfLanes(d32, hn::Add(x0, x1))),
          hn::GetLane(hn::SumOfLanes(d32, hn::Add(y0, y1)))};
}

// Offsets of the rotated pattern in an image.
void TurnPattern(const PatchDirection& direction, std::ptrdiff_t step, int32_t* offsets) {
  static const OrbPattern& pattern = GetOrbPattern();
  const hn::CappedTag<int32_t, 8> d32;
  const hn::Rebind<int16_t, decltype(d32)> d;
  const size_t lanes = hn::Lanes(d);
  const auto cos = hn::Set(d, direction.cos), sin = hn::Set(d, direction.sin),
             half = hn::Set(d, 512);
  const auto rows = hn::Set(d32, static_cast<int32_t>(step));
  for (size_t i = 0; i < 512; i += lanes) {
    const auto x = hn::Load(d, pattern.x.data() + i), y = hn::Load(d, pattern.y.data() + i);
    const auto u = hn::ShiftRight<10>(hn::Add(hn::Sub(hn::Mul(x, cos), hn::Mul(y, sin)), half));
    const auto v = hn::ShiftRight<10>(hn::Add(hn::Add(hn::Mul(x, sin), hn::Mul(y, cos)), half));
    hn::Store(hn::Add(hn::Mul(hn::PromoteTo(d32, v), rows), hn::PromoteTo(d32, u)), d32,
              offsets + i);
  }
}

// Sets bit i where first[i] < second[i], of 256.
void CompareBytes(const uint8_t* first, const uint8_t* second, uint8_t* bits) {
  const Bytes d;
  const size_t lanes = hn::Lanes(d);
  for (size_t i = 0; i < 256; i += lanes) {
    const auto less =
        hn::Ne(hn::SaturatedSub(hn::Load(d, second + i), hn::Load(d, first + i)), hn::Zero(d));
    uint32_t word = 0;
    hn::StoreMaskBits(d, less, reinterpret_cast<uint8_t*>(&word));
    for (size_t j = 0; j < lanes; j += 8)
      bits[(i + j) / 8] |= static_cast<uint8_t>(word >> j << i % 8);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {
namespace {

HWY_EXPORT(ScoreRow);
HWY_EXPORT(AppendMaxima);
HWY_EXPORT(BlurColumns);
HWY_EXPORT(BlurRow);
HWY_EXPORT(SumMoments);
HWY_EXPORT(TurnPattern);
HWY_EXPORT(CompareBytes);

constexpr int kPatternValues[1024] = {
#include "oaslam/features/orb_pattern.inc"
};

// Mirrors an index at the border without repeating the outermost pixel.
int Mirrored(int i, int size) { return i < 0 ? -i : i >= size ? 2 * size - 2 - i : i; }

}  // namespace

std::vector<Corner> DetectFast(const GreyImage& image, uint8_t threshold,
                               std::vector<uint8_t>& scores) {
  OASLAM_CHECK(image.width >= kMinKernelWidth);
  std::vector<Corner> corners;
  if (image.height <= 2 * kFastRing) return corners;
  // Only the inner part is written; the border stays zero.
  scores.assign(static_cast<size_t>(image.width) * image.height, 0);
  const int inner_width = image.width - 2 * kFastRing;
  const auto row_of_scores = [&](int y) {
    return scores.data() + static_cast<size_t>(y) * image.width + kFastRing;
  };
  for (int y = kFastRing; y < image.height - kFastRing; ++y) HWY_DYNAMIC_DISPATCH(ScoreRow)
  (image.Row(y) + kFastRing, image.step, inner_width, threshold, row_of_scores(y));
  for (int y = kFastRing; y < image.height - kFastRing; ++y) HWY_DYNAMIC_DISPATCH(AppendMaxima)
  (row_of_scores(y), image.width, inner_width, kFastRing, y, corners);
  return corners;
}

void BlurGaussian7(const GreyImage& image, uint8_t* blurred, std::ptrdiff_t blurred_step) {
  constexpr int kReach = 3;
  OASLAM_CHECK(image.width >= kMinKernelWidth && image.height > kReach);
  std::vector<uint16_t> padded(static_cast<size_t>(image.width) + 2 * kReach);
  uint16_t* sums = padded.data() + kReach;
  for (int y = 0; y < image.height; ++y) {
    const uint8_t* rows[7];
    for (int k = -kReach; k <= kReach; ++k)
      rows[k + kReach] = image.Row(Mirrored(y + k, image.height));
    HWY_DYNAMIC_DISPATCH(BlurColumns)(rows, image.width, sums);
    for (int k = 1; k <= kReach; ++k) {
      sums[-k] = sums[k];
      sums[image.width - 1 + k] = sums[image.width - 1 - k];
    }
    HWY_DYNAMIC_DISPATCH(BlurRow)(sums, image.width, blurred + y * blurred_step);
  }
}

Moments PatchMoments(const uint8_t* center, std::ptrdiff_t step) {
  return HWY_DYNAMIC_DISPATCH(SumMoments)(center, step);
}

PatchDirection DirectionOf(const Moments& moments) {
  const double x = moments.x, y = moments.y, norm = std::sqrt(x * x + y * y);
  if (norm == 0) return {};
  return {static_cast<int16_t>(std::lround(1024 * x / norm)),
          static_cast<int16_t>(std::lround(1024 * y / norm))};
}

Descriptor Describe(const uint8_t* center, std::ptrdiff_t step, const PatchDirection& direction) {
  alignas(64) std::array<int32_t, 512> offsets;
  HWY_DYNAMIC_DISPATCH(TurnPattern)(direction, step, offsets.data());
  alignas(64) std::array<uint8_t, 512> values;
  for (size_t i = 0; i < values.size(); ++i) values[i] = center[offsets[i]];
  Descriptor descriptor{};
  HWY_DYNAMIC_DISPATCH(CompareBytes)
  (values.data(), values.data() + 256, reinterpret_cast<uint8_t*>(descriptor.data()));
  return descriptor;
}

const OrbPattern& GetOrbPattern() {
  static const OrbPattern pattern = [] {
    OrbPattern p{};
    for (int i = 0; i < 512; ++i) {
      const int place = i % 2 == 0 ? i / 2 : 256 + i / 2;
      p.x[place] = static_cast<int16_t>(kPatternValues[2 * i]);
      p.y[place] = static_cast<int16_t>(kPatternValues[2 * i + 1]);
    }
    return p;
  }();
  return pattern;
}

const std::array<int, kPatchRadius + 1>& DiscHalfWidths() {
  static const std::array<int, kPatchRadius + 1> widths = [] {
    std::array<int, kPatchRadius + 1> half{};
    for (int v = 0; v <= kPatchRadius; ++v)
      half[v] = static_cast<int>(std::lround(std::sqrt(kPatchRadius * kPatchRadius - v * v)));
    return half;
  }();
  return widths;
}

}  // namespace oaslam

#endif  // HWY_ONCE
