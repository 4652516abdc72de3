#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/camera.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {

// Parameters of an ellipsoid, in this order: centre (world, 3), logarithms of the half axes (3),
// then small rotations [rad] about its own third, first and second axis. The first seven describe
// an ellipsoid with a fixed third axis.
constexpr int kShapeParameters = 9;
using ShapeVector = Eigen::Matrix<double, kShapeParameters, 1>;

Ellipsoid Moved(const Ellipsoid& ellipsoid, const ShapeVector& change);

// An ellipsoid seen from a pose, with the values that its outline and its derivatives need.
struct EllipsoidView {
  Eigen::Vector3d center;              // in the camera's frame
  Eigen::Matrix3d cam_from_ellipsoid;  // rotation
  Eigen::Matrix3d cam_from_world;      // rotation
  Eigen::Vector3d half_axes;
  OutlineConic outline;
};

// Nothing unless the ellipsoid is completely in front of the camera.
std::optional<EllipsoidView> ViewEllipsoid(const Ellipsoid& ellipsoid,
                                           const Rigid3& cam_from_world);

// Derivatives of the box edges (x1, y1, x2, y2), px.
using EdgesByShape = Eigen::Matrix<double, 4, kShapeParameters>;
using EdgesByPose = Eigen::Matrix<double, 4, 6>;
EdgesByShape DifferentiateByShape(const EllipsoidView& view, const Camera& camera);
EdgesByPose DifferentiateByPose(const EllipsoidView& view, const Camera& camera);

// Derivatives of (mean x, mean y, covariance xx, xy, yy) of the outline's ellipse; px, px^2.
using EllipseByShape = Eigen::Matrix<double, 5, kShapeParameters>;
EllipseByShape DifferentiateEllipse(const EllipsoidView& view, const Camera& camera);

}  // namespace oaslam
