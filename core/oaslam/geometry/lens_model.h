#pragma once

#include <Eigen/Core>

#include "oaslam/camera.h"

namespace oaslam {

// Points of the plane z = 1, as the lens of a camera moves them; without focal length and principal
// point.

// A distorted point, with its derivatives by the undistorted one and by the first two coefficients.
struct DistortedPoint {
  Eigen::Vector2d point;
  Eigen::Matrix2d by_point;
  Eigen::Matrix2d by_radial;
};
DistortedPoint DistortPoint(const Camera& camera, const Eigen::Vector2d& undistorted);

// The inverse of DistortPoint; where there is none, the result is finite but has no meaning.
// `max_lens_angle`: the result of MaxLensAngle.
Eigen::Vector2d UndistortPoint(const Camera& camera, double max_lens_angle,
                               const Eigen::Vector2d& distorted);

// The derivative of the distance from the centre in the image, without tangential distortion, by
// the angle from the optical axis (fisheye) or by its tangent (pinhole).
double LensSlope(const Camera& camera, double angle);

}  // namespace oaslam
