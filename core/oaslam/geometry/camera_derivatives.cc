#include "oaslam/geometry/camera_derivatives.h"

#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/lens_model.h"

namespace oaslam {

Camera WithIntrinsicsStep(const Camera& camera, const IntrinsicsStep& step) {
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
  const DistortedPoint d = DistortPoint(camera, p);
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
