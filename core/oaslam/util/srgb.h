#pragma once

#include <cmath>

namespace oaslam {

// The transfer function of sRGB (IEC 61966-2-1) and its inverse, for values in [0, 1].
template <typename Real>
Real LinearFromSrgb(Real s) {
  return s <= Real(0.04045) ? s / Real(12.92)
                            : std::pow((s + Real(0.055)) / Real(1.055), Real(2.4));
}
inline float SrgbFromLinear(float l) {
  return l <= 0.0031308F ? 12.92F * l : 1.055F * std::pow(l, 1 / 2.4F) - 0.055F;
}

}  // namespace oaslam
