#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "oaslam/features/grey_image.h"
#include "oaslam/util/rng.h"

namespace oaslam::synthetic {

// An image of grey(x, y), which takes pixels of the border, too.
template <typename Grey>
GreyBuffer Drawn(int width, int height, Grey&& grey, int border = 0) {
  GreyBuffer image(width, height, border);
  for (int y = -border; y < height + border; ++y)
    for (int x = -border; x < width + border; ++x)
      image.Row(y)[x] = static_cast<uint8_t>(grey(x, y));
  return image;
}

inline GreyBuffer Noise(int width, int height, uint64_t seed) {
  Rng rng(seed);
  return Drawn(width, height, [&](int, int) { return rng.Index(256); });
}

// The noise is in squares of `px` pixels, and repeats itself after `side` of them.
class NoiseSquares {
 public:
  NoiseSquares(int side, int px, uint64_t seed) : side_(side), px_(px) {
    Rng rng(seed);
    for (int i = 0; i < side * side; ++i)
      squares_.push_back(static_cast<uint8_t>(rng.Uniform(20, 235)));
  }
  uint8_t At(int x, int y) const {
    const auto wrapped = [&](int k) { return (k / px_ % side_ + side_) % side_; };
    return squares_[wrapped(y) * side_ + wrapped(x)];
  }

 private:
  int side_, px_;
  std::vector<uint8_t> squares_;
};

// 300 even rectangles over each other, with edges as soft as those of a lens.
inline GreyBuffer RandomScene(int width, int height, uint64_t seed) {
  Rng rng(seed);
  GreyBuffer sharp = Drawn(
      width, height, [](int, int) { return 90; }, 1);
  for (int i = 0; i < 300; ++i) {
    const int left = rng.Index(width - 20), top = rng.Index(height - 20);
    const int right = std::min(width, left + 8 + rng.Index(40)),
              bottom = std::min(height, top + 8 + rng.Index(40)), grey = rng.Index(256);
    for (int y = top; y < bottom; ++y)
      std::fill(sharp.Row(y) + left, sharp.Row(y) + right, static_cast<uint8_t>(grey));
  }
  sharp.MirrorBorder();
  return Drawn(width, height, [&](int x, int y) {
    const auto row = [&](int v) {
      const uint8_t* p = sharp.Row(v) + x;
      return p[-1] + 2 * p[0] + p[1];
    };
    return (row(y - 1) + 2 * row(y) + row(y + 1) + 8) / 16;
  });
}

}  // namespace oaslam::synthetic
