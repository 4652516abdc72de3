#include "oaslam/geometry/lens_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace oaslam {
namespace {

// Radial-tangential (Brown 1966, OpenCV's order of coefficients).
DistortedPoint DistortPinhole(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double slope = 2 * (k[0] + r2 * (2 * k[1] + 3 * r2 * k[4]));  // d radial / d r2, times 2
  DistortedPoint d;
  d.point = {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
             y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
  const double mixed = slope * x * y + 2 * k[2] * x + 2 * k[3] * y;
  d.by_point << radial + slope * x * x + 2 * k[2] * y + 6 * k[3] * x, mixed, mixed,
      radial + slope * y * y + 6 * k[2] * y + 2 * k[3] * x;
  d.by_radial << x * r2, x * r2 * r2, y * r2, y * r2 * r2;
  return d;
}

// By the tangent of the angle.
double PinholeSlope(const std::array<double, 5>& k, double theta) {
  const double r2 = std::tan(theta) * std::tan(theta);
  return 1 + r2 * (3 * k[0] + r2 * (5 * k[1] + r2 * 7 * k[4]));
}

// Newton's method on the exact model; where it does not converge (outside of the model's range) the
// last iterate is returned.
Eigen::Vector2d UndistortPinhole(const std::array<double, 5>& k, const Eigen::Vector2d& distorted) {
  Eigen::Vector2d p = distorted;
  for (int i = 0; i < 20; ++i) {
    const DistortedPoint here = DistortPinhole(k, p);
    const Eigen::Vector2d step = here.by_point.partialPivLu().solve(distorted - here.point);
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

double FisheyeSlope(const std::array<double, 5>& k, double theta) {
  const double t2 = theta * theta;
  return 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
}

DistortedPoint DistortFisheye(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double r = p.norm();
  if (r < 1e-12) return {p, Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Zero()};
  const double theta = std::atan(r), t2 = theta * theta, scale = FisheyeRadius(k, theta) / r;
  const Eigen::Vector2d direction = p / r;
  DistortedPoint d;
  d.point = p * scale;
  d.by_point = scale * Eigen::Matrix2d::Identity() +
               (FisheyeSlope(k, theta) / (1 + r * r) - scale) * direction * direction.transpose();
  d.by_radial << direction * (theta * t2), direction * (theta * t2 * t2);
  return d;
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

DistortedPoint DistortPoint(const Camera& camera, const Eigen::Vector2d& undistorted) {
  return camera.model == LensModel::kPinhole ? DistortPinhole(camera.distortion, undistorted)
                                             : DistortFisheye(camera.distortion, undistorted);
}

Eigen::Vector2d UndistortPoint(const Camera& camera, double max_lens_angle,
                               const Eigen::Vector2d& distorted) {
  return camera.model == LensModel::kPinhole
             ? UndistortPinhole(camera.distortion, distorted)
             : UndistortFisheye(camera.distortion, max_lens_angle, distorted);
}

double LensSlope(const Camera& camera, double angle) {
  return camera.model == LensModel::kFisheye ? FisheyeSlope(camera.distortion, angle)
                                             : PinholeSlope(camera.distortion, angle);
}

}  // namespace oaslam
