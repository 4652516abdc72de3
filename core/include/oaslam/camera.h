#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <tuple>

#include "oaslam/export.h"

namespace oaslam {

// How the lens distorts the image of a pinhole.
enum class LensModel {
  kPinhole,  // pinhole with radial-tangential distortion: k1 k2 p1 p2 k3 (OpenCV's order; zeros:
             // none)
  kFisheye,  // equidistant (Kannala-Brandt) distortion: k1 k2 k3 k4
};
OASLAM_API const char* ToString(LensModel model);  // "pinhole" or "fisheye"

// A calibrated camera. In its frame x points to the right of the image, y down and z forward, as in
// OpenCV and COLMAP. Pixel centres are at integer coordinates: the centre of the upper left pixel
// is (0, 0), where COLMAP has (0.5, 0.5). Distances in the image are in pixels:
//
//   Camera camera{.width = 640, .height = 480, .fx = 525, .fy = 525, .cx = 319.5, .cy = 239.5};
//   const std::optional<Eigen::Vector2d> pixel = camera.Project({0.1, 0, 2});
//   if (pixel) std::cout << pixel->transpose() << "\n";
struct Camera {
  LensModel model = LensModel::kPinhole;
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::array<double, 5> distortion{};
  bool is_guess = false;  // made from a field of view, not calibrated
  std::string name{};
  // The standard deviation of the logarithm of the focal length where this is only roughly known:
  // of a camera that the images do not determine, or of a lens that has changed; else 0.
  // Covariances of poses include it. Not saved in a map.
  double focal_sigma = 0;

  // Whether a coefficient is not 0.
  bool HasDistortion() const {
    for (const double k : distortion)
      if (k != 0) return true;
    return false;
  }
  // The pixel of a point in the camera's frame, inside of the image or not. Nothing for a point
  // that is not in front of the camera, or beyond the angle up to which the lens model is valid.
  OASLAM_API std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& in_cam) const;
  // The ray of a pixel: the point in the camera's frame that the pixel shows at the depth z = 1.
  // Nothing where the lens model has no inverse.
  OASLAM_API std::optional<Eigen::Vector3d> Lift(const Eigen::Vector2d& pixel) const;

  // Whether all but focal_sigma is the same.
  bool operator==(const Camera& other) const {
    const auto all = [](const Camera& c) {
      return std::tie(c.model, c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.distortion, c.is_guess,
                      c.name);
    };
    return all(*this) == all(other);
  }
};

}  // namespace oaslam
