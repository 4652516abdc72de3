#pragma once

#include <cstdint>
#include <vector>

#include "oaslam/features/orb_kernels.h"

namespace oaslam {

// An image and its halvings: pixel (x, y) of a level is pixel (2 x, 2 y) of the level below, after
// a binomial of 5 x 5 (Burt and Adelson 1983). In integers, so that every machine gives the same.
class GreyPyramid {
 public:
  // So many pixels beyond each edge may be read; they mirror the image.
  static constexpr int kBorder = 16;

  GreyPyramid() = default;
  // Ends before a level would be smaller than twice the border, whatever `levels` says.
  GreyPyramid(const GreyImage& image, int levels);

  int levels() const { return static_cast<int>(levels_.size()); }
  GreyImage level(int i) const;
  // So many levels go, from the lowest on; at least one stays.
  void DropLowest(int count);

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<uint8_t> pixels;  // with the border

    Level(int w, int h);
    int step() const { return width + 2 * kBorder; }
    uint8_t* Row(int y) { return pixels.data() + (y + kBorder) * step() + kBorder; }
    const uint8_t* Row(int y) const { return pixels.data() + (y + kBorder) * step() + kBorder; }
    void FillBorder();
  };
  static Level Halved(const Level& level);

  std::vector<Level> levels_;
};

}  // namespace oaslam
