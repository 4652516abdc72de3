#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/camera.h"
#include "oaslam/geometry/ellipse.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// Columns: the half axes as vectors in the world, rotation * diag(half_axes).
Eigen::Matrix3d ScaledAxes(const Ellipsoid& ellipsoid);

// The dual conic of an ellipsoid's outline in the plane z = 1 of a camera, C* = B B^T - p p^T with
// p the centre and B the scaled axes in the camera's frame (P Q* P^T of the dual quadric Q*,
// Hartley and Zisserman, "Multiple View Geometry", 8.2). Symmetric; its sign is kept.
struct OutlineConic {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
};

inline OutlineConic OutlineOf(const Eigen::Vector3d& p, const Eigen::Matrix3d& b) {
  return {b.row(0).dot(b.row(0)) - p.x() * p.x(), b.row(0).dot(b.row(1)) - p.x() * p.y(),
          b.row(0).dot(b.row(2)) - p.x() * p.z(), b.row(1).dot(b.row(1)) - p.y() * p.y(),
          b.row(1).dot(b.row(2)) - p.y() * p.z(), b.row(2).dot(b.row(2)) - p.z() * p.z()};
}

// The outline is an ellipse only if the whole ellipsoid is in front of the camera's principal
// plane: z > 0 and C*_33 < 0 (by more than rounding errors). Behind the camera C*_33 is below 0,
// too.
inline bool IsInFront(double center_z, const OutlineConic& c) {
  return center_z > 0 && c.zz < -1e-9 * center_z * center_z;
}

// The outline, and the box around it (ideal image, box convention), where it IsInFront.
Ellipse OutlineEllipse(const OutlineConic& c, const Camera& camera);
Box OutlineBox(const OutlineConic& c, const Camera& camera);

// Nothing unless the ellipsoid is completely in front of the camera.
std::optional<Ellipse> ProjectToEllipse(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world,
                                        const Camera& camera);
std::optional<Box> ProjectToBox(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world,
                                const Camera& camera);

struct Box3 {
  Eigen::Vector3d min, max;
};

// The box around the ellipsoid along the world's axes.
Box3 BoundingBox(const Ellipsoid& ellipsoid);
double IoU(const Box3& a, const Box3& b);
bool Contains(const Ellipsoid& ellipsoid, const Eigen::Vector3d& point);

}  // namespace oaslam
