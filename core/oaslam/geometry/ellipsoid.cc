#include "oaslam/geometry/ellipsoid.h"

#include <cmath>

#include "oaslam/geometry/box.h"

namespace oaslam {
namespace {

struct InCamera {
  Eigen::Vector3d center;
  OutlineConic outline;
};

InCamera View(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world) {
  InCamera view;
  view.center = cam_from_world * ellipsoid.center;
  view.outline =
      OutlineOf(view.center, cam_from_world.rotation.toRotationMatrix() * ScaledAxes(ellipsoid));
  return view;
}

}  // namespace

Eigen::Matrix3d ScaledAxes(const Ellipsoid& ellipsoid) {
  return ellipsoid.rotation.toRotationMatrix() * ellipsoid.half_axes.asDiagonal();
}

Box OutlineBox(const OutlineConic& c, const Camera& camera) {
  const double scale = 1 / c.zz, x = c.xz * scale, y = c.yz * scale;
  const double half_width = camera.fx * std::sqrt(x * x - c.xx * scale);
  const double half_height = camera.fy * std::sqrt(y * y - c.yy * scale);
  const double u = camera.fx * x + camera.cx + kBoxFromPixel,
               v = camera.fy * y + camera.cy + kBoxFromPixel;
  return {u - half_width, v - half_height, u + half_width, v + half_height};
}

Ellipse OutlineEllipse(const OutlineConic& c, const Camera& camera) {
  const double x = c.xz / c.zz, y = c.yz / c.zz;
  Ellipse ellipse;
  ellipse.mean = {camera.fx * x + camera.cx, camera.fy * y + camera.cy};
  ellipse.covariance(0, 0) = camera.fx * camera.fx * (x * x - c.xx / c.zz);
  ellipse.covariance(1, 1) = camera.fy * camera.fy * (y * y - c.yy / c.zz);
  ellipse.covariance(0, 1) = ellipse.covariance(1, 0) =
      camera.fx * camera.fy * (x * y - c.xy / c.zz);
  return ellipse;
}

std::optional<Ellipse> ProjectToEllipse(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world,
                                        const Camera& camera) {
  const InCamera view = View(ellipsoid, cam_from_world);
  if (!IsInFront(view.center.z(), view.outline)) return std::nullopt;
  return OutlineEllipse(view.outline, camera);
}

std::optional<Box> ProjectToBox(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world,
                                const Camera& camera) {
  const InCamera view = View(ellipsoid, cam_from_world);
  if (!IsInFront(view.center.z(), view.outline)) return std::nullopt;
  return OutlineBox(view.outline, camera);
}

Box3 BoundingBox(const Ellipsoid& ellipsoid) {
  const Eigen::Vector3d half = ScaledAxes(ellipsoid).rowwise().norm();
  return {ellipsoid.center - half, ellipsoid.center + half};
}

double IoU(const Box3& a, const Box3& b) {
  const Eigen::Array3d shared = (a.max.cwiseMin(b.max) - a.min.cwiseMax(b.min)).array().max(0);
  const double both = shared.prod(), joint = (a.max - a.min).prod() + (b.max - b.min).prod() - both;
  return joint > 0 ? both / joint : 0;
}

bool Contains(const Ellipsoid& ellipsoid, const Eigen::Vector3d& point) {
  const Eigen::Vector3d local = ellipsoid.rotation.conjugate() * (point - ellipsoid.center);
  return local.cwiseQuotient(ellipsoid.half_axes).squaredNorm() <= 1;
}

}  // namespace oaslam
