#include "oaslam/geometry/camera_model.h"

#include <algorithm>
#include <cmath>

namespace oaslam {
namespace {

// Radial-tangential distortion of a point of the plane z = 1 (Brown 1966, OpenCV's order of
// coefficients).
Eigen::Vector2d DistortPinhole(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

Eigen::Matrix2d DistortPinholeJacobian(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double slope = 2 * (k[0] + r2 * (2 * k[1] + 3 * r2 * k[4]));  // d radial / d r2, times 2
  Eigen::Matrix2d j;
  j << radial + slope * x * x + 2 * k[2] * y + 6 * k[3] * x,
      slope * x * y + 2 * k[2] * x + 2 * k[3] * y, slope * x * y + 2 * k[2] * x + 2 * k[3] * y,
      radial + slope * y * y + 6 * k[2] * y + 2 * k[3] * x;
  return j;
}

// Newton's method on the exact model; where it does not converge (outside of the model's range) the
// last iterate is returned.
Eigen::Vector2d UndistortPinhole(const std::array<double, 5>& k, const Eigen::Vector2d& distorted) {
  Eigen::Vector2d p = distorted;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d step =
        DistortPinholeJacobian(k, p).partialPivLu().solve(distorted - DistortPinhole(k, p));
    if (!step.allFinite() || step.norm() > 10) return distorted;
    p += step;
    if (step.squaredNorm() < 1e-24) break;
  }
  return p;
}

// Kannala & Brandt 2006, equidistant: r_d = theta (1 + k1 theta^2 + k2 theta^4 + ...).
double FisheyeRadius(const std::array<double, 5>& k, double theta) {
  const double t2 = theta * theta;
  return theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
}

Eigen::Vector2d DistortFisheye(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double r = p.norm();
  return r < 1e-12 ? p : Eigen::Vector2d(p * (FisheyeRadius(k, std::atan(r)) / r));
}

double FisheyeSlope(const std::array<double, 5>& k, double theta) {
  const double t2 = theta * theta;
  return 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
}

// Derivative of the distorted radius by that in the plane z = 1, without tangential distortion.
double PinholeSlope(const std::array<double, 5>& k, double theta) {
  const double r2 = std::tan(theta) * std::tan(theta);
  return 1 + r2 * (3 * k[0] + r2 * (5 * k[1] + r2 * 7 * k[4]));
}

// Newton's method, kept within the interval that contains the root: the radius
// increases up to `max_theta`.
Eigen::Vector2d UndistortFisheye(const std::array<double, 5>& k, double max_theta,
                                 const Eigen::Vector2d& distorted) {
  const double radius = distorted.norm();
  if (radius < 1e-12) return distorted;
  double low = 0, high = max_theta, theta = std::min(radius, max_theta);
  if (radius >= FisheyeRadius(k, max_theta)) low = theta = max_theta;
  for (int i = 0; i < 60 && low < high; ++i) {
    const double error = FisheyeRadius(k, theta) - radius;
    (error > 0 ? high : low) = theta;
    const double newton = theta - error / FisheyeSlope(k, theta);
    const double next = newton > low && newton < high ? newton : (low + high) / 2;
    const double step = std::abs(next - theta);
    theta = next;
    if (step < 1e-13) break;
  }
  return distorted * (std::tan(theta) / radius);
}

}  // namespace

Eigen::Vector2d Undistort(const Camera& camera, const Eigen::Vector2d& pixel) {
  return Undistort(camera, MaxLensAngle(camera), pixel);
}

Eigen::Vector2d Undistort(const Camera& camera, double max_lens_angle,
                          const Eigen::Vector2d& pixel) {
  if (!camera.HasDistortion() && camera.model == LensModel::kPinhole) return pixel;
  const Eigen::Vector2d p((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  const Eigen::Vector2d u = camera.model == LensModel::kPinhole
                                ? UndistortPinhole(camera.distortion, p)
                                : UndistortFisheye(camera.distortion, max_lens_angle, p);
  return {camera.fx * u.x() + camera.cx, camera.fy * u.y() + camera.cy};
}

double MaxLensAngle(const Camera& camera) {
  // A ray at 90 degrees (1.5708 rad) or more does not meet a pinhole image.
  constexpr double kMaxTheta = 1.55;
  // Steps of 0.01 rad find where the model folds; 40 halvings of one reach a double's precision.
  constexpr int kSteps = 155, kHalvings = 40;
  if (!camera.HasDistortion()) return kMaxTheta;
  const auto slope = [&](double theta) {
    return camera.model == LensModel::kFisheye ? FisheyeSlope(camera.distortion, theta)
                                               : PinholeSlope(camera.distortion, theta);
  };
  for (int i = 1; i <= kSteps; ++i) {
    double low = kMaxTheta * (i - 1) / kSteps, high = kMaxTheta * i / kSteps;
    if (slope(high) > 0) continue;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = (low + high) / 2;
      (slope(middle) > 0 ? low : high) = middle;
    }
    return low;
  }
  return kMaxTheta;
}

Eigen::Vector2d Distort(const Camera& camera, const Eigen::Vector2d& ideal) {
  if (!camera.HasDistortion() && camera.model == LensModel::kPinhole) return ideal;
  const Eigen::Vector2d p((ideal.x() - camera.cx) / camera.fx, (ideal.y() - camera.cy) / camera.fy);
  const Eigen::Vector2d d = camera.model == LensModel::kPinhole
                                ? DistortPinhole(camera.distortion, p)
                                : DistortFisheye(camera.distortion, p);
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
