#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace oaslam {

// A view of an 8-bit grey image, whose pixels belong to somebody else. `step` is the distance of
// rows in bytes.
struct GreyImage {
  const uint8_t* data = nullptr;
  std::ptrdiff_t step = 0;
  int width = 0, height = 0;  // pixels

  const uint8_t* Row(int y) const { return data + y * step; }
  // The image without `margin` pixels along each edge.
  GreyImage Inside(int margin) const {
    return {Row(margin) + margin, step, width - 2 * margin, height - 2 * margin};
  }
};

// An 8-bit grey image that owns its pixels, which are black at first. It has `border` more pixels
// beyond each edge, which may be read and written, too.
class GreyBuffer {
 public:
  GreyBuffer() = default;
  GreyBuffer(int width, int height, int border = 0);

  int width() const { return width_; }
  int height() const { return height_; }
  std::ptrdiff_t step() const { return width_ + 2 * std::ptrdiff_t{border_}; }
  uint8_t* Row(int y) { return pixels_.data() + Offset(y); }
  const uint8_t* Row(int y) const { return pixels_.data() + Offset(y); }
  // Without the border; valid as long as the buffer.
  GreyImage view() const { return {Row(0), step(), width_, height_}; }

  // Lets the border mirror the image, without repeating the outermost pixels. The image must be
  // wider and higher than the border.
  void MirrorBorder();

 private:
  std::ptrdiff_t Offset(int y) const { return (y + border_) * step() + border_; }

  int width_ = 0, height_ = 0, border_ = 0;
  std::vector<uint8_t> pixels_;
};

}  // namespace oaslam
