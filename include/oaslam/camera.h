#pragma once

#include <array>
#include <string>

#include "oaslam/export.h"

namespace oaslam {

// How the lens distorts the image of a pinhole.
enum class LensModel {
  kPinhole,  // pinhole with radial-tangential distortion: k1 k2 p1 p2 k3 (OpenCV's order; zeros:
             // none)
  kFisheye,  // equidistant (Kannala-Brandt) distortion: k1 k2 k3 k4
};
OASLAM_API const char* ToString(LensModel model);  // "pinhole" or "fisheye"

// A calibrated camera. Pixel centres are at integer coordinates; distances in pixels.
struct Camera {
  LensModel model = LensModel::kPinhole;
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::array<double, 5> distortion{};
  bool is_guess = false;  // made from a field of view, not calibrated
  std::string name{};

  // Whether a coefficient is not 0.
  bool HasDistortion() const {
    for (const double k : distortion)
      if (k != 0) return true;
    return false;
  }
  bool operator==(const Camera&) const = default;
};

}  // namespace oaslam
