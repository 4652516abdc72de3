#pragma once

#include <vector>

#include "oaslam/features/grey_image.h"

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
  GreyImage level(int i) const { return levels_[i].view(); }
  // So many levels go, from the lowest on; at least one stays.
  void DropLowest(int count);

 private:
  std::vector<GreyBuffer> levels_;
};

}  // namespace oaslam
