#include "oaslam/features/resize_kernels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/features/resize_kernels.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR
void InRow(const uint8_t* row, std::span<const ResizeWindow> windows, const int16_t* weights,
           int16_t* results) {
  for (const ResizeWindow& w : windows)
    for (int i = 0; i < ResizeWindow::kResults; ++i) {
      const int left = row[w.first + w.pairs[2 * i]], right = row[w.first + w.pairs[2 * i + 1]];
      const int product = (right - left) * weights[w.result + i];
      results[w.result + i] = static_cast<int16_t>(left * 128 + (product >> 4));
    }
}
#else
void InRow(const uint8_t* row, std::span<const ResizeWindow> windows, const int16_t* weights,
           int16_t* results) {
  const hn::FixedTag<uint8_t, ResizeWindow::kPixels> d8;
  const hn::Repartition<int16_t, decltype(d8)> d;
  const hn::RebindToUnsigned<decltype(d)> d_unsigned;
  for (const ResizeWindow& w : windows) {
    const auto pairs = hn::BitCast(
        d_unsigned, hn::TableLookupBytes(hn::LoadU(d8, row + w.first), hn::Load(d8, w.pairs)));
    const auto left = hn::BitCast(d, hn::And(pairs, hn::Set(d_unsigned, 255)));
    const auto difference = hn::Sub(hn::BitCast(d, hn::ShiftRight<8>(pairs)), left);
    const auto weight = hn::LoadU(d, weights + w.result);
    // The product has 20 bits with its sign: a sixteenth of it is put together from its two halves.
    const auto high = hn::ShiftLeft<12>(hn::MulHigh(difference, weight));
    const auto low = hn::ShiftRight<4>(hn::BitCast(d_unsigned, hn::Mul(difference, weight)));
    hn::StoreU(hn::Add(hn::ShiftLeft<7>(left), hn::Or(high, hn::BitCast(d, low))), d,
               results + w.result);
  }
}
#endif

void BetweenRows(const int16_t* first, const int16_t* second, int16_t weight, int width,
                 uint8_t* grey) {
  const hn::CappedTag<int16_t, kMinInterpolatedWidth> d;
  const hn::Rebind<uint8_t, decltype(d)> d8;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto weight1 = hn::Set(d, static_cast<int16_t>(2048 - weight)),
             weight2 = hn::Set(d, weight);
  for (int next = 0; next < width; next += lanes) {
    const int x = std::min(next, width - lanes);  // the last vector overlaps the one before
    // MulHigh(v / 128 grey, weight / 2048) is in 1/4 grey levels.
    const auto sum = hn::Add(hn::MulHigh(hn::LoadU(d, first + x), weight1),
                             hn::MulHigh(hn::LoadU(d, second + x), weight2));
    hn::StoreU(hn::DemoteTo(d8, hn::ShiftRight<2>(hn::Add(sum, hn::Set(d, 2)))), d8, grey + x);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {
namespace {

HWY_EXPORT(InRow);
HWY_EXPORT(BetweenRows);

}  // namespace

void InterpolateInRow(const uint8_t* row, std::span<const ResizeWindow> windows,
                      const int16_t* weights, int16_t* results) {
  HWY_DYNAMIC_DISPATCH(InRow)(row, windows, weights, results);
}

void InterpolateBetweenRows(const int16_t* first, const int16_t* second, int16_t weight, int width,
                            uint8_t* grey) {
  HWY_DYNAMIC_DISPATCH(BetweenRows)(first, second, weight, width, grey);
}

}  // namespace oaslam

#endif  // HWY_ONCE
