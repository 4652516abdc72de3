#include "oaslam/odometry/patch_kernels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/odometry/patch_kernels.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::CappedTag<int16_t, kPatchSide>;
using WordVec = hn::Vec<Words>;

// From `a` to `b` by a fraction in 1 / 32768.
HWY_INLINE WordVec Between(WordVec a, WordVec b, WordVec fraction) {
  return hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), fraction));
}

// Columns of interpolated pixels, a row after the other.
class Columns {
 public:
  Columns(const PatchPlace& first, int column)
      : next_(first.pixel + column),
        step_(first.step),
        right_(hn::Set(Words(), first.right)),
        down_(hn::Set(Words(), first.down)),
        above_(InRow()) {}

  HWY_INLINE WordVec Next() {
    next_ += step_;
    const WordVec below = InRow(), between = Between(above_, below, down_);
    above_ = below;
    constexpr int shift = kRowBits - kPatchGreyBits;
    return hn::ShiftRight<shift>(hn::Add(between, hn::Set(Words(), 1 << (shift - 1))));
  }

 private:
  static constexpr int kRowBits = 7;  // fractional bits of a pixel that fit 16 bits with its sign

  HWY_INLINE WordVec InRow() const {
    const auto at = [](const uint8_t* p) {
      return hn::ShiftLeft<kRowBits>(
          hn::PromoteTo(Words(), hn::LoadU(hn::Rebind<uint8_t, Words>(), p)));
    };
    return Between(at(next_), at(next_ + 1), right_);
  }

  const uint8_t* next_;
  std::ptrdiff_t step_;
  WordVec right_, down_, above_;
};

// A sum of products over the rows of some columns. A product is below 2^26, and a lane of the
// result takes two of each row at most, so that it stays within 32 bits.
class Products {
 public:
  Products() : first_(hn::Zero(kD)), second_(hn::Zero(kD)) {}
  HWY_INLINE void Add(WordVec a, WordVec b) {
    first_ = hn::ReorderWidenMulAccumulate(kD, a, b, first_, second_);
  }
  HWY_INLINE int64_t Sum() const {
    return hn::GetLane(
        hn::SumOfLanes(hn::RepartitionToWide<Wide>(), hn::Add(Widened(first_), Widened(second_))));
  }

 private:
  using Wide = hn::RepartitionToWide<Words>;
  using Vec = hn::Vec<Wide>;
  static constexpr Wide kD{};

  static HWY_INLINE hn::Vec<hn::RepartitionToWide<Wide>> Widened(Vec v) {
    const hn::RepartitionToWide<Wide> d;
#if HWY_TARGET == HWY_SCALAR
    return hn::PromoteTo(d, v);
#else
    return hn::Add(hn::PromoteTo(d, hn::LowerHalf(v)),
                   hn::PromoteTo(d, hn::UpperHalf(hn::Half<Wide>(), v)));
#endif
  }

  Vec first_, second_;
};

void Derive(const PatchPlace& first, DerivedPatch& out) {
  const Words d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int16_t wide[kPatchRim * kPatchRim];
  for (int next = 0; next < kPatchRim; next += lanes) {
    const int c = std::min(next, kPatchRim - lanes);  // the last vector overlaps the one before
    Columns columns(first, c);
    for (int r = 0; r < kPatchRim; ++r) hn::StoreU(columns.Next(), d, wide + r * kPatchRim + c);
  }
  // Scharr's weights 3, 10, 3 over 16, in 1 / 32768.
  const WordVec outer = hn::Set(d, 3 << 11), middle = hn::Set(d, 10 << 11), one = hn::Set(d, 1);
  const auto slope = [&](WordVec twice_outer, WordVec inner) {
    return hn::Add(hn::MulFixedPoint15(twice_outer, outer), hn::MulFixedPoint15(inner, middle));
  };
  out.sum_x = out.sum_y = out.xx = out.xy = out.yy = 0;
  for (int c = 0; c < kPatchSide; c += lanes) {
    Products sum_x, sum_y, xx, xy, yy;
    for (int r = 0; r < kPatchSide; ++r) {
      const auto at = [&](int row, int column) {
        return hn::LoadU(d, wide + (r + row) * kPatchRim + c + column);
      };
      const WordVec a = at(0, 0), b = at(0, 2), e = at(2, 0), f = at(2, 2);
      const WordVec falling = hn::Sub(f, a), rising = hn::Sub(b, e);
      const WordVec x = slope(hn::Add(falling, rising), hn::Sub(at(1, 2), at(1, 0)));
      const WordVec y = slope(hn::Sub(falling, rising), hn::Sub(at(2, 1), at(0, 1)));
      const int i = r * kPatchSide + c;
      hn::StoreU(at(1, 1), d, out.grey.data() + i);
      hn::StoreU(x, d, out.dx.data() + i);
      hn::StoreU(y, d, out.dy.data() + i);
      sum_x.Add(x, one);
      sum_y.Add(y, one);
      xx.Add(x, x);
      xy.Add(x, y);
      yy.Add(y, y);
    }
    out.sum_x += sum_x.Sum();
    out.sum_y += sum_y.Sum();
    out.xx += xx.Sum();
    out.xy += xy.Sum();
    out.yy += yy.Sum();
  }
}

void Compare(const DerivedPatch& patch, const PatchPlace& first, PatchDifference& out) {
  const Words d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const WordVec one = hn::Set(d, 1);
  for (int c = 0; c < kPatchSide; c += lanes) {
    Columns columns(first, c);
    Products sum, by_x, by_y;
    for (int i = c; i < kPatchSide * kPatchSide; i += kPatchSide) {
      const WordVec difference = hn::Sub(columns.Next(), hn::LoadU(d, patch.grey.data() + i));
      sum.Add(difference, one);
      by_x.Add(difference, hn::LoadU(d, patch.dx.data() + i));
      by_y.Add(difference, hn::LoadU(d, patch.dy.data() + i));
    }
    out.sum += sum.Sum();
    out.by_x += by_x.Sum();
    out.by_y += by_y.Sum();
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {

HWY_EXPORT(Derive);
HWY_EXPORT(Compare);

void DerivePatch(const PatchPlace& first, DerivedPatch& out) {
  HWY_DYNAMIC_DISPATCH(Derive)(first, out);
}

PatchDifference ComparePatch(const DerivedPatch& patch, const PatchPlace& first) {
  PatchDifference difference;
  HWY_DYNAMIC_DISPATCH(Compare)(patch, first, difference);
  return difference;
}

}  // namespace oaslam

#endif  // HWY_ONCE
