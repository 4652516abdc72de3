#include "oaslam/features/grey_image.h"

#include <algorithm>
#include <cstring>

#include "oaslam/util/check.h"

namespace oaslam {

GreyBuffer::GreyBuffer(int width, int height, int border)
    : width_(width),
      height_(height),
      border_(border),
      pixels_(static_cast<size_t>(width + 2 * border) * (height + 2 * border)) {}

void GreyBuffer::MirrorBorder() {
  OASLAM_CHECK(std::min(width_, height_) > border_);
  for (int y = 0; y < height_; ++y) {
    uint8_t* row = Row(y);
    for (int i = 1; i <= border_; ++i) {
      row[-i] = row[i];
      row[width_ - 1 + i] = row[width_ - 1 - i];
    }
  }
  for (int i = 1; i <= border_; ++i) {
    std::memcpy(Row(-i) - border_, Row(i) - border_, step());
    std::memcpy(Row(height_ - 1 + i) - border_, Row(height_ - 1 - i) - border_, step());
  }
}

}  // namespace oaslam
