#include "oaslam/geometry/ellipsoid_jacobian.h"

#include <cmath>

namespace oaslam {
namespace {

// scale * (u w^T + w u^T).
OutlineConic SymmetricProduct(double scale, const Eigen::Vector3d& u, const Eigen::Vector3d& w) {
  return {2 * scale * u.x() * w.x(),
          scale * (u.x() * w.y() + u.y() * w.x()),
          scale * (u.x() * w.z() + u.z() * w.x()),
          2 * scale * u.y() * w.y(),
          scale * (u.y() * w.z() + u.z() * w.y()),
          2 * scale * u.z() * w.z()};
}

// The change of C* with each parameter: C* = sum_i a_i^2 v_i v_i^T - p p^T.
template <typename Visitor>
void VisitShapeChanges(const EllipsoidView& view, Visitor&& visit) {
  for (int k = 0; k < 3; ++k)
    visit(k, SymmetricProduct(-1, view.cam_from_world.col(k), view.center));
  const Eigen::Vector3d squared = view.half_axes.cwiseAbs2();
  const Eigen::Matrix3d& v = view.cam_from_ellipsoid;
  for (int k = 0; k < 3; ++k) visit(3 + k, SymmetricProduct(squared[k], v.col(k), v.col(k)));
  constexpr int kAxis[3] = {2, 0, 1};
  for (int k = 0; k < 3; ++k) {
    const int i = (kAxis[k] + 1) % 3, j = (kAxis[k] + 2) % 3;
    visit(6 + k, SymmetricProduct(squared[i] - squared[j], v.col(i), v.col(j)));
  }
}

// The terms that the derivatives of mean +- sqrt(variance) along one image axis share.
struct AxisTerms {
  double mean, moment, inverse_zz, half_inverse_deviation, focal;

  AxisTerms(double cross, double square, double zz, double f)
      : mean(cross / zz),
        moment(square / zz),
        inverse_zz(1 / zz),
        half_inverse_deviation(0.5 / std::sqrt(mean * mean - moment)),
        focal(f) {}

  double MeanChange(double d_cross, double d_zz) const {
    return (d_cross - mean * d_zz) * inverse_zz;
  }
  double VarianceChange(double d_mean, double d_square, double d_zz) const {
    return 2 * mean * d_mean - (d_square - moment * d_zz) * inverse_zz;
  }
};

struct EdgeDifferential {
  AxisTerms x, y;

  EdgeDifferential(const OutlineConic& c, const Camera& camera)
      : x(c.xz, c.xx, c.zz, camera.fx), y(c.yz, c.yy, c.zz, camera.fy) {}

  Eigen::Vector4d operator()(const OutlineConic& d) const {
    const double dx = x.MeanChange(d.xz, d.zz), dy = y.MeanChange(d.yz, d.zz);
    const double width = x.VarianceChange(dx, d.xx, d.zz) * x.half_inverse_deviation;
    const double height = y.VarianceChange(dy, d.yy, d.zz) * y.half_inverse_deviation;
    return {x.focal * (dx - width), y.focal * (dy - height), x.focal * (dx + width),
            y.focal * (dy + height)};
  }
};

}  // namespace

Ellipsoid Moved(const Ellipsoid& ellipsoid, const ShapeVector& change) {
  Ellipsoid moved;
  moved.center = ellipsoid.center + change.head<3>();
  moved.half_axes = ellipsoid.half_axes.array() * change.segment<3>(3).array().exp();
  const Eigen::Vector3d turn(change[7], change[8], change[6]);
  moved.rotation = (ellipsoid.rotation * RotationOf(turn)).normalized();
  return moved;
}

std::optional<EllipsoidView> ViewEllipsoid(const Ellipsoid& ellipsoid,
                                           const Rigid3& cam_from_world) {
  EllipsoidView view;
  view.center = cam_from_world * ellipsoid.center;
  view.cam_from_world = cam_from_world.rotation.toRotationMatrix();
  view.cam_from_ellipsoid = view.cam_from_world * ellipsoid.rotation.toRotationMatrix();
  view.half_axes = ellipsoid.half_axes;
  view.outline = OutlineOf(view.center, view.cam_from_ellipsoid * ellipsoid.half_axes.asDiagonal());
  if (!IsInFront(view.center.z(), view.outline)) return std::nullopt;
  return view;
}

EdgesByShape DifferentiateByShape(const EllipsoidView& view, const Camera& camera) {
  EdgesByShape jacobian;
  const EdgeDifferential edges(view.outline, camera);
  VisitShapeChanges(
      view, [&](int column, const OutlineConic& change) { jacobian.col(column) = edges(change); });
  return jacobian;
}

EdgesByPose DifferentiateByPose(const EllipsoidView& view, const Camera& camera) {
  EdgesByPose jacobian;
  const EdgeDifferential edges(view.outline, camera);
  const OutlineConic& c = view.outline;
  for (int k = 0; k < 3; ++k)
    jacobian.col(k) = edges(SymmetricProduct(-1, Eigen::Vector3d::Unit(k), view.center));
  // C* turns with the camera: dC* = [w] C* + ([w] C*)^T.
  jacobian.col(3) = edges({0, -c.xz, c.xy, -2 * c.yz, c.yy - c.zz, 2 * c.yz});
  jacobian.col(4) = edges({2 * c.xz, c.yz, c.zz - c.xx, 0, -c.xy, -2 * c.xz});
  jacobian.col(5) = edges({-2 * c.xy, c.xx - c.yy, -c.yz, 2 * c.xy, c.xz, 0});
  return jacobian;
}

EllipseByShape DifferentiateEllipse(const EllipsoidView& view, const Camera& camera) {
  EllipseByShape jacobian;
  const OutlineConic& c = view.outline;
  const AxisTerms x(c.xz, c.xx, c.zz, camera.fx), y(c.yz, c.yy, c.zz, camera.fy);
  const double inverse_zz = 1 / c.zz, xy = c.xy * inverse_zz;
  VisitShapeChanges(view, [&](int column, const OutlineConic& d) {
    const double dx = x.MeanChange(d.xz, d.zz), dy = y.MeanChange(d.yz, d.zz);
    const double dxy = dx * y.mean + x.mean * dy - (d.xy - xy * d.zz) * inverse_zz;
    jacobian.col(column) << camera.fx * dx, camera.fy * dy,
        camera.fx * camera.fx * x.VarianceChange(dx, d.xx, d.zz), camera.fx * camera.fy * dxy,
        camera.fy * camera.fy * y.VarianceChange(dy, d.yy, d.zz);
  });
  return jacobian;
}

}  // namespace oaslam
