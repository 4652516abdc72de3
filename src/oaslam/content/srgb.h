#pragma once

#include <cmath>

namespace oaslam {

// The transfer function of sRGB (IEC 61966-2-1), for values in [0, 1].
inline float LinearFromSrgb(float s) {
  return s <= 0.04045F ? s / 12.92F : std::pow((s + 0.055F) / 1.055F, 2.4F);
}
inline float SrgbFromLinear(float l) {
  return l <= 0.0031308F ? 12.92F * l : 1.055F * std::pow(l, 1 / 2.4F) - 0.055F;
}

}  // namespace oaslam
