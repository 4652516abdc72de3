#include "oaslam/geometry/camera_model.h"

#include <algorithm>

#include "oaslam/geometry/lens_model.h"

namespace oaslam {

Eigen::Vector2d Undistort(const Camera& camera, const Eigen::Vector2d& pixel) {
  return Undistort(camera, MaxLensAngle(camera), pixel);
}

Eigen::Vector2d Undistort(const Camera& camera, double max_lens_angle,
                          const Eigen::Vector2d& pixel) {
  if (!camera.HasDistortion() && camera.model == LensModel::kPinhole) return pixel;
  const Eigen::Vector2d p((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  const Eigen::Vector2d u = UndistortPoint(camera, max_lens_angle, p);
  return {camera.fx * u.x() + camera.cx, camera.fy * u.y() + camera.cy};
}

double MaxLensAngle(const Camera& camera) {
  // A ray at 90 degrees (1.5708 rad) or more does not meet a pinhole image.
  constexpr double kMaxTheta = 1.55;
  // Steps of 0.01 rad find where the model folds; 40 halvings of one reach a double's precision.
  constexpr int kSteps = 155, kHalvings = 40;
  if (!camera.HasDistortion()) return kMaxTheta;
  for (int i = 1; i <= kSteps; ++i) {
    double low = kMaxTheta * (i - 1) / kSteps, high = kMaxTheta * i / kSteps;
    if (LensSlope(camera, high) > 0) continue;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = (low + high) / 2;
      (LensSlope(camera, middle) > 0 ? low : high) = middle;
    }
    return low;
  }
  return kMaxTheta;
}

Eigen::Vector2d Distort(const Camera& camera, const Eigen::Vector2d& ideal) {
  if (!camera.HasDistortion() && camera.model == LensModel::kPinhole) return ideal;
  const Eigen::Vector2d p((ideal.x() - camera.cx) / camera.fx, (ideal.y() - camera.cy) / camera.fy);
  const Eigen::Vector2d d = DistortPoint(camera, p).point;
  return {camera.fx * d.x() + camera.cx, camera.fy * d.y() + camera.cy};
}

Box UndistortBox(const Camera& camera, const Box& box) {
  const double mid_x = (box.x1 + box.x2) / 2 - 0.5, mid_y = (box.y1 + box.y2) / 2 - 0.5;
  return {Undistort(camera, {box.x1 - 0.5, mid_y}).x() + 0.5,
          Undistort(camera, {mid_x, box.y1 - 0.5}).y() + 0.5,
          Undistort(camera, {box.x2 - 0.5, mid_y}).x() + 0.5,
          Undistort(camera, {mid_x, box.y2 - 0.5}).y() + 0.5};
}

Box IdealImageBounds(const Camera& camera) {
  Box bounds{1e9, 1e9, -1e9, -1e9};
  constexpr int kSteps = 32;  // points of each side; distortion is smooth between them
  for (int i = 0; i <= kSteps; ++i) {
    const double x = (camera.width - 1.0) * i / kSteps, y = (camera.height - 1.0) * i / kSteps;
    for (const Eigen::Vector2d& border :
         {Eigen::Vector2d(x, 0), Eigen::Vector2d(x, camera.height - 1), Eigen::Vector2d(0, y),
          Eigen::Vector2d(camera.width - 1, y)}) {
      const Eigen::Vector2d p = Undistort(camera, border);
      bounds = {std::min(bounds.x1, p.x()), std::min(bounds.y1, p.y()), std::max(bounds.x2, p.x()),
                std::max(bounds.y2, p.y())};
    }
  }
  return {bounds.x1 - 0.5, bounds.y1 - 0.5, bounds.x2 + 0.5, bounds.y2 + 0.5};
}

unsigned char TruncatedEdges(const Camera& camera, const Box& box) {
  const double margin_px = 3 * DetectorPixel(camera);  // about the error of a box's edge
  unsigned char edges = 0;
  if (box.x1 <= margin_px) edges |= kLeft;
  if (box.y1 <= margin_px) edges |= kTop;
  if (box.x2 >= camera.width - margin_px) edges |= kRight;
  if (box.y2 >= camera.height - margin_px) edges |= kBottom;
  return edges;
}

std::optional<double> ZoomBetween(const Camera& from, const Camera& to) {
  constexpr double kRounding = 1e-9;
  const double ratio = to.fx / from.fx;
  Camera zoomed = Zoomed(from, ratio);
  if (!(std::abs(zoomed.fy / to.fy - 1) < kRounding)) return std::nullopt;
  zoomed.fx = to.fx;
  zoomed.fy = to.fy;
  const bool is_known = !from.is_guess && !to.is_guess;  // else it may be an error
  return (is_known || from == to) && zoomed == to ? std::optional(ratio) : std::nullopt;
}

Camera Zoomed(const Camera& camera, double ratio) {
  Camera zoomed = camera;
  zoomed.fx *= ratio;
  zoomed.fy *= ratio;
  return zoomed;
}

Camera Scaled(const Camera& camera, int width, int height) {
  const double sx = static_cast<double>(width) / camera.width,
               sy = static_cast<double>(height) / camera.height;
  Camera scaled = camera;
  scaled.width = width;
  scaled.height = height;
  scaled.fx *= sx;
  scaled.fy *= sy;
  scaled.cx = (camera.cx + 0.5) * sx - 0.5;
  scaled.cy = (camera.cy + 0.5) * sy - 0.5;
  return scaled;
}

}  // namespace oaslam
