#pragma once

#include <algorithm>
#include <vector>

#include "oaslam/features/grey_image.h"

namespace oaslam {

// Parts of the images of a camera that move with it, as a bonnet or a robot's chassis do, or that
// were drawn over the images. No point there tells how the camera moved.
class ImageMask {
 public:
  ImageMask() = default;  // hides nothing
  // `visible` is stretched over the image; 0 hides.
  explicit ImageMask(const GreyImage& visible) : width_(visible.width), height_(visible.height) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) hidden_.push_back(visible.Row(y)[x] == 0);
  }

  // Whether the mask hides the place at (x, y), given as shares of the image's width and height
  // from the upper left corner.
  bool Hides(double x, double y) const {
    if (hidden_.empty()) return false;
    const auto at = [](double share, int size) {
      return std::clamp(static_cast<int>(share * size), 0, size - 1);
    };
    return hidden_[at(y, height_) * width_ + at(x, width_)] != 0;
  }
  double HiddenShare() const {
    return hidden_.empty() ? 0
                           : static_cast<double>(std::ranges::count(hidden_, 1)) /
                                 static_cast<double>(hidden_.size());
  }
  bool operator==(const ImageMask&) const = default;

 private:
  int width_ = 0, height_ = 0;
  std::vector<char> hidden_;
};

}  // namespace oaslam
