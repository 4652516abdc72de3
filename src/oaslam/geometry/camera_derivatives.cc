#include "oaslam/geometry/camera_derivatives.h"

#include <cmath>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// A distorted point of the plane z = 1, with derivatives by the undistorted point and by the first
// two coefficients.
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d by_point;
  Eigen::Matrix2d by_radial;
};

Distorted DistortPinhole(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double slope = 2 * (k[0] + r2 * (2 * k[1] + 3 * r2 * k[4]));  // by r2, times 2
  Distorted d;
  d.point = {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
             y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
  const double mixed = slope * x * y + 2 * k[2] * x + 2 * k[3] * y;
  d.by_point << radial + slope * x * x + 2 * k[2] * y + 6 * k[3] * x, mixed, mixed,
      radial + slope * y * y + 6 * k[2] * y + 2 * k[3] * x;
  d.by_radial << x * r2, x * r2 * r2, y * r2, y * r2 * r2;
  return d;
}

Distorted DistortFisheye(const std::array<double, 5>& k, const Eigen::Vector2d& p) {
  const double r = p.norm();
  Distorted d{p, Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Zero()};
  if (r < 1e-9) return d;
  const double theta = std::atan(r), t2 = theta * theta;
  const double radius = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  const double slope = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
  const Eigen::Vector2d direction = p / r;
  d.point = radius * direction;
  d.by_point = radius / r * Eigen::Matrix2d::Identity() +
               (slope / (1 + r * r) - radius / r) * direction * direction.transpose();
  d.by_radial << direction * (theta * t2), direction * (theta * t2 * t2);
  return d;
}

Distorted DistortWithDerivatives(const Camera& camera, const Eigen::Vector2d& p) {
  return camera.model == LensModel::kPinhole ? DistortPinhole(camera.distortion, p)
                                             : DistortFisheye(camera.distortion, p);
}

}  // namespace

Camera Changed(const Camera& camera, const IntrinsicsStep& step) {
  Camera changed = camera;
  const double factor = std::exp(step[0]);
  changed.fx *= factor;
  changed.fy *= factor;
  changed.cx += step[1];
  changed.cy += step[2];
  changed.distortion[0] += step[3];
  changed.distortion[1] += step[4];
  return changed;
}

Eigen::Vector2d PixelOf(const Camera& camera, const Eigen::Vector3d& x_in_cam) {
  return Distort(camera, ProjectIdeal(camera, x_in_cam));
}

PixelDerivatives PixelWithDerivatives(const Camera& camera, const Eigen::Vector3d& x_in_cam) {
  const double inverse_z = 1 / x_in_cam.z();
  const Eigen::Vector2d p = x_in_cam.head<2>() * inverse_z;
  const Distorted d = DistortWithDerivatives(camera, p);
  const Eigen::DiagonalMatrix<double, 2> focal(camera.fx, camera.fy);
  PixelDerivatives result;
  const Eigen::Vector2d from_center = focal * d.point;
  result.px = from_center + Eigen::Vector2d(camera.cx, camera.cy);
  result.by_point.leftCols<2>() = focal * d.by_point * inverse_z;
  result.by_point.col(2) = -result.by_point.leftCols<2>() * p;
  result.by_intrinsics << from_center, Eigen::Matrix2d::Identity(), focal * d.by_radial;
  return result;
}

}  // namespace oaslam
