#include "oaslam/odometry/grey_pyramid.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "oaslam/util/check.h"

namespace oaslam {
namespace {

GreyBuffer Halved(const GreyBuffer& level) {
  GreyBuffer half((level.width() + 1) / 2, (level.height() + 1) / 2, GreyPyramid::kBorder);
  // The sums of a column over five rows, from two pixels left of the image on.
  std::vector<uint16_t> sums(2 * half.width() + 4);
  for (int y = 0; y < half.height(); ++y) {
    const uint8_t* r[5];
    for (int i = 0; i < 5; ++i) r[i] = level.Row(2 * y + i - 2) - 2;
    const int n = static_cast<int>(sums.size());
    for (int x = 0; x < n; ++x)
      sums[x] = static_cast<uint16_t>(r[0][x] + r[4][x] + 4 * (r[1][x] + r[3][x]) + 6 * r[2][x]);
    uint8_t* out = half.Row(y);
    for (int x = 0; x < half.width(); ++x) {
      const uint16_t* s = sums.data() + 2 * x;
      out[x] = static_cast<uint8_t>((s[0] + s[4] + 4 * (s[1] + s[3]) + 6 * s[2] + 128) >> 8);
    }
  }
  half.MirrorBorder();
  return half;
}

}  // namespace

GreyPyramid::GreyPyramid(const GreyImage& image, int levels) {
  OASLAM_CHECK(std::min(image.width, image.height) > 2 * kBorder);
  GreyBuffer& full = levels_.emplace_back(image.width, image.height, kBorder);
  for (int y = 0; y < image.height; ++y) std::memcpy(full.Row(y), image.Row(y), image.width);
  full.MirrorBorder();
  while (this->levels() < levels) {
    GreyBuffer half = Halved(levels_.back());
    if (std::min(half.width(), half.height()) <= 2 * kBorder) break;
    levels_.push_back(std::move(half));
  }
}

void GreyPyramid::DropLowest(int count) {
  OASLAM_CHECK(count < levels());
  levels_.erase(levels_.begin(), levels_.begin() + count);
}

}  // namespace oaslam
