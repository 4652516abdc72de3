#pragma once

#include <Eigen/Core>
#include <vector>

#include "oaslam/features/grey_image.h"

namespace oaslam {

// Whether a place, px, lies within an image.
inline bool IsIn(const GreyImage& image, const Eigen::Vector2f& px) {
  return px.x() >= 0 && px.y() >= 0 && px.x() <= static_cast<float>(image.width - 1) &&
         px.y() <= static_cast<float>(image.height - 1);
}

// An image and its halvings: pixel (x, y) of a level is pixel (2 x, 2 y) of the level below, after
// a binomial of 5 x 5 (Burt and Adelson 1983). In integers, so that every machine gives the same.
class GreyPyramid {
 public:
  // So many pixels beyond each edge may be read; they mirror the image.
  static constexpr int kBorder = 16;

  GreyPyramid() = default;
  GreyPyramid(const GreyImage& image, int levels) {
    std::vector<GreyBuffer> none;
    Set(image, 0, levels, none);
  }

  // Makes the pyramid of another image; reuses the memory. The first `dropped` halvings are made in
  // `scratch` and not kept. Ends before a level would be smaller than twice the border, whatever
  // `levels` says, but makes one level at least.
  void Set(const GreyImage& image, int dropped, int levels, std::vector<GreyBuffer>& scratch);

  int levels() const { return static_cast<int>(levels_.size()); }
  GreyImage level(int i) const { return levels_[i].view(); }

 private:
  std::vector<GreyBuffer> levels_;
};

}  // namespace oaslam
