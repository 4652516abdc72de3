#include <cmath>

#include "oaslam/camera.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {

std::optional<Eigen::Vector2d> Camera::Project(const Eigen::Vector3d& in_cam) const {
  const double angle = std::atan2(in_cam.head<2>().norm(), in_cam.z());
  if (!(angle < MaxLensAngle(*this))) return std::nullopt;
  return Distort(*this, ProjectIdeal(*this, in_cam));
}

std::optional<Eigen::Vector3d> Camera::Lift(const Eigen::Vector2d& pixel) const {
  constexpr double kMaxError = 1e-6;  // of the inverse of the lens model, pixels; rounding only
  const Eigen::Vector3d ray = RayOf(*this, Undistort(*this, pixel));
  const std::optional<Eigen::Vector2d> back = Project(ray);
  // The iteration that inverts the lens model only ends there where the model has an inverse.
  return back && (*back - pixel).norm() < kMaxError ? std::optional(ray) : std::nullopt;
}

}  // namespace oaslam
