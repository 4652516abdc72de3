#pragma once

#include <cmath>

namespace oaslam {

// The inverse of the transfer function of sRGB (IEC 61966-2-1), for values in [0, 1].
template <typename Real>
Real LinearFromSrgb(Real s) {
  return s <= Real(0.04045) ? s / Real(12.92)
                            : std::pow((s + Real(0.055)) / Real(1.055), Real(2.4));
}

}  // namespace oaslam
