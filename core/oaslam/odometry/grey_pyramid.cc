#include "oaslam/odometry/grey_pyramid.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// With a border; what it held is overwritten.
void Resize(int width, int height, GreyBuffer& buffer) {
  if (buffer.width() != width || buffer.height() != height)
    buffer = GreyBuffer(width, height, GreyPyramid::kBorder);
}

void Halve(const GreyBuffer& level, GreyBuffer& half) {
  Resize((level.width() + 1) / 2, (level.height() + 1) / 2, half);
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
}

}  // namespace

void GreyPyramid::Set(const GreyImage& image, int dropped, int levels,
                      std::vector<GreyBuffer>& scratch) {
  OASLAM_CHECK(std::min(image.width, image.height) > 2 * kBorder);
  scratch.resize(dropped);
  levels_.resize(levels);
  const auto level = [&](int i) -> GreyBuffer& {
    return i < dropped ? scratch[i] : levels_[i - dropped];
  };
  Resize(image.width, image.height, level(0));
  for (int y = 0; y < image.height; ++y) std::memcpy(level(0).Row(y), image.Row(y), image.width);
  level(0).MirrorBorder();
  for (int i = 1; i < dropped + levels; ++i) {
    const GreyBuffer& below = level(i - 1);
    if ((std::min(below.width(), below.height()) + 1) / 2 <= 2 * kBorder) {
      OASLAM_CHECK(i > dropped);
      levels_.resize(i - dropped);
      return;
    }
    Halve(below, level(i));
  }
}

}  // namespace oaslam
