#include "oaslam/odometry/grey_pyramid.h"

#include <algorithm>
#include <cstring>

#include "oaslam/util/check.h"

namespace oaslam {

GreyPyramid::Level::Level(int w, int h)
    : width(w), height(h), pixels(static_cast<size_t>(w + 2 * kBorder) * (h + 2 * kBorder)) {}

void GreyPyramid::Level::FillBorder() {
  for (int y = 0; y < height; ++y) {
    uint8_t* row = Row(y);
    for (int i = 1; i <= kBorder; ++i) {
      row[-i] = row[i];
      row[width - 1 + i] = row[width - 1 - i];
    }
  }
  for (int i = 1; i <= kBorder; ++i) {
    std::memcpy(Row(-i) - kBorder, Row(i) - kBorder, step());
    std::memcpy(Row(height - 1 + i) - kBorder, Row(height - 1 - i) - kBorder, step());
  }
}

GreyPyramid::Level GreyPyramid::Halved(const Level& level) {
  Level half((level.width + 1) / 2, (level.height + 1) / 2);
  // The sums of a column over five rows, from two pixels left of the image on.
  std::vector<uint16_t> sums(2 * half.width + 4);
  for (int y = 0; y < half.height; ++y) {
    const uint8_t* r[5];
    for (int i = 0; i < 5; ++i) r[i] = level.Row(2 * y + i - 2) - 2;
    const int n = static_cast<int>(sums.size());
    for (int x = 0; x < n; ++x)
      sums[x] = static_cast<uint16_t>(r[0][x] + r[4][x] + 4 * (r[1][x] + r[3][x]) + 6 * r[2][x]);
    uint8_t* out = half.Row(y);
    for (int x = 0; x < half.width; ++x) {
      const uint16_t* s = sums.data() + 2 * x;
      out[x] = static_cast<uint8_t>((s[0] + s[4] + 4 * (s[1] + s[3]) + 6 * s[2] + 128) >> 8);
    }
  }
  return half;
}

GreyPyramid::GreyPyramid(const GreyImage& image, int levels) {
  OASLAM_CHECK(std::min(image.width, image.height) > 2 * kBorder);
  Level& full = levels_.emplace_back(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    std::memcpy(full.Row(y), image.data + y * image.step, image.width);
  full.FillBorder();
  while (this->levels() < levels) {
    Level half = Halved(levels_.back());
    if (std::min(half.width, half.height) <= 2 * kBorder) break;
    half.FillBorder();
    levels_.push_back(std::move(half));
  }
}

void GreyPyramid::DropLowest(int count) {
  OASLAM_CHECK(count < levels());
  levels_.erase(levels_.begin(), levels_.begin() + count);
}

GreyImage GreyPyramid::level(int i) const {
  const Level& l = levels_[i];
  return {l.Row(0), l.step(), l.width, l.height};
}

}  // namespace oaslam
