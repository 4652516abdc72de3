#include "oaslam/features/band_search.h"

#include <bit>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/features/band_search.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Returns how many of the `count` points are near the line; `found` has room for all.
size_t SearchBand(const float* xs, const float* ys, const float* tolerances, size_t count, float a,
                  float b, float c, int32_t* found) {
  const hn::CappedTag<float, 8> d;
  const size_t lanes = hn::Lanes(d);
  const auto line_x = hn::Set(d, a), line_y = hn::Set(d, b), offset = hn::Set(d, c);
  size_t n = 0, i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto distance = hn::Abs(hn::Add(
        hn::Add(hn::Mul(line_x, hn::LoadU(d, xs + i)), hn::Mul(line_y, hn::LoadU(d, ys + i))),
        offset));
    uint32_t bits = 0;
    hn::StoreMaskBits(d, hn::Le(distance, hn::LoadU(d, tolerances + i)),
                      reinterpret_cast<uint8_t*>(&bits));
    for (; bits; bits &= bits - 1) found[n++] = static_cast<int32_t>(i) + std::countr_zero(bits);
  }
  for (; i < count; ++i)
    if (std::abs(a * xs[i] + b * ys[i] + c) <= tolerances[i]) found[n++] = static_cast<int32_t>(i);
  return n;
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {
namespace {

HWY_EXPORT(SearchBand);

}  // namespace

void BandPoints::Add(const Eigen::Vector2f& point, float tolerance_px) {
  x.push_back(point.x());
  y.push_back(point.y());
  tolerance.push_back(tolerance_px);
}

std::span<const int32_t> PointsNearLine(const BandPoints& points, const Eigen::Vector3f& line,
                                        std::vector<int32_t>& found) {
  found.resize(points.x.size());
  const size_t count =
      HWY_DYNAMIC_DISPATCH(SearchBand)(points.x.data(), points.y.data(), points.tolerance.data(),
                                       points.x.size(), line.x(), line.y(), line.z(), found.data());
  return std::span(found).first(count);
}

}  // namespace oaslam

#endif  // HWY_ONCE
