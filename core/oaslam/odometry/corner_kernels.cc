#include "oaslam/odometry/corner_kernels.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/odometry/corner_kernels.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// All rows of the scratch are padded by a vector of the widest kind, so that loops need no rest.
using Wide = hn::CappedTag<int32_t, 16>;
using Half = hn::Rebind<int16_t, Wide>;
using Floats = hn::Rebind<float, Wide>;
using WideVec = hn::Vec<Wide>;
constexpr int kPad = 16;
constexpr int kTensor = 3;  // xx + yy, xx - yy, xy

// Sobel's derivatives of a row, eight times the slopes, and their products.
HWY_INLINE void ProductsOfRow(const uint8_t* const rows[3], int width, int stride,
                              CornerScratch& s) {
  const Half h;
  const Wide w;
  const int lanes = static_cast<int>(hn::Lanes(w));
  int16_t *smooth = s.smooth.data(), *slope = s.slope.data();
  for (int x = 0; x < width + 2; x += lanes) {
    const auto at = [&](int row) {
      return hn::PromoteTo(h, hn::LoadU(hn::Rebind<uint8_t, Half>(), rows[row] + x));
    };
    const auto above = at(0), middle = at(1), below = at(2);
    hn::StoreU(hn::Add(hn::Add(above, below), hn::Add(middle, middle)), h, smooth + x);
    hn::StoreU(hn::Sub(below, above), h, slope + x);
  }
  int32_t* out = s.products.data();
  for (int x = 0; x < width; x += lanes) {
    const WideVec dx =
        hn::PromoteTo(w, hn::Sub(hn::LoadU(h, smooth + x + 2), hn::LoadU(h, smooth + x)));
    const auto middle = hn::LoadU(h, slope + x + 1);
    const WideVec dy =
        hn::PromoteTo(w, hn::Add(hn::Add(hn::LoadU(h, slope + x), hn::LoadU(h, slope + x + 2)),
                                 hn::Add(middle, middle)));
    const WideVec xx = hn::Mul(dx, dx), yy = hn::Mul(dy, dy);
    hn::StoreU(hn::Add(xx, yy), w, out + x);
    hn::StoreU(hn::Sub(xx, yy), w, out + stride + x);
    hn::StoreU(hn::Mul(dx, dy), w, out + 2 * stride + x);
  }
}

void Strengths(const GreyImage& image, const ImageArea& area, CornerScratch& s, float* strengths) {
  constexpr int kSide = 2 * kCornerBlock + 1;
  const Wide w;
  const Floats f;
  const int lanes = static_cast<int>(hn::Lanes(w));
  const int width = area.width() + kSide - 1, height = area.height() + kSide - 1;
  const int stride = width + 2 + 2 * kPad;
  s.pixels.resize(static_cast<size_t>(stride) * 3);
  s.smooth.resize(stride);
  s.slope.resize(stride);
  s.products.resize(static_cast<size_t>(stride) * kTensor);
  s.rows.resize(static_cast<size_t>(stride) * kTensor * kSide);
  s.columns.assign(static_cast<size_t>(stride) * kTensor, 0);
  // The image may end beside the area, so that its pixels are copied before they are read.
  const auto copy = [&](int y) {
    uint8_t* to = s.pixels.data() + y % 3 * stride;
    std::memcpy(to, image.Row(area.y1 - kCornerBlock - 1 + y) + area.x1 - kCornerBlock - 1,
                width + 2);
    return to;
  };
  copy(0);
  copy(1);
  for (int y = 0; y < height; ++y) {
    copy(y + 2);
    const uint8_t* const rows[] = {s.pixels.data() + y % 3 * stride,
                                   s.pixels.data() + (y + 1) % 3 * stride,
                                   s.pixels.data() + (y + 2) % 3 * stride};
    ProductsOfRow(rows, width, stride, s);
    // The sums over a block: what the newest row adds, less what the oldest one had added.
    for (int t = 0; t < kTensor; ++t) {
      const int32_t* from = s.products.data() + t * stride;
      int32_t *row = s.rows.data() + (y % kSide * kTensor + t) * stride,
              *column = s.columns.data() + t * stride;
      for (int x = 0; x < area.width(); x += lanes) {
        WideVec sum = hn::LoadU(w, from + x);
        for (int i = 1; i < kSide; ++i) sum = hn::Add(sum, hn::LoadU(w, from + x + i));
        WideVec total = hn::Add(hn::LoadU(w, column + x), sum);
        if (y >= kSide) total = hn::Sub(total, hn::LoadU(w, row + x));
        hn::StoreU(sum, w, row + x);
        hn::StoreU(total, w, column + x);
      }
    }
    if (y < kSide - 1) continue;
    float* out = strengths + static_cast<ptrdiff_t>(y - kSide + 1) * area.width();
    const auto half = hn::Set(f, 0.5F), scale = hn::Set(f, 1.0F / 64);
    for (int x = 0; x < area.width(); x += lanes) {
      const auto at = [&](int t) {
        return hn::ConvertTo(f, hn::LoadU(w, s.columns.data() + t * stride + x));
      };
      const auto mean = hn::Mul(half, at(0)), difference = hn::Mul(half, at(1)), xy = at(2);
      const auto root = hn::Sqrt(hn::Add(hn::Mul(difference, difference), hn::Mul(xy, xy)));
      hn::StoreU(hn::Mul(hn::Sub(mean, root), scale), f, out + x);
    }
  }
}

int Largest(const float* values, int count) {
  const Floats f;
  const int lanes = static_cast<int>(hn::Lanes(f));
  float largest = values[0];
  int i = 0;
  if (count >= lanes) {
    auto most = hn::LoadU(f, values);
    for (i = lanes; i + lanes <= count; i += lanes) most = hn::Max(most, hn::LoadU(f, values + i));
    largest = hn::GetLane(hn::MaxOfLanes(f, most));
  }
  for (; i < count; ++i) largest = std::max(largest, values[i]);
  const auto asked = hn::Set(f, largest);
  for (i = 0; i + lanes <= count; i += lanes) {
    const auto first = hn::FindFirstTrue(f, hn::Eq(hn::LoadU(f, values + i), asked));
    if (first >= 0) return i + static_cast<int>(first);
  }
  while (values[i] != largest) ++i;
  return i;
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {

HWY_EXPORT(Strengths);
HWY_EXPORT(Largest);

void CornerStrengths(const GreyImage& image, const ImageArea& area, CornerScratch& scratch,
                     std::vector<float>& strengths) {
  const size_t size = static_cast<size_t>(area.width()) * area.height();
  constexpr size_t kPad = 16;  // the last vector goes beyond the area
  strengths.resize(size + kPad);
  HWY_DYNAMIC_DISPATCH(Strengths)(image, area, scratch, strengths.data());
  strengths.resize(size);
}

int IndexOfLargest(const std::vector<float>& values) {
  return HWY_DYNAMIC_DISPATCH(Largest)(values.data(), static_cast<int>(values.size()));
}

}  // namespace oaslam

#endif  // HWY_ONCE
