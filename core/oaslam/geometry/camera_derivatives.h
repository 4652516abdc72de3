#pragma once

#include <Eigen/Core>

#include "oaslam/camera.h"

namespace oaslam {

// The parameters of a camera that a self-calibration may change: the logarithm of the
// focal length (of both axes, whose ratio stays), the principal point (pixels), and the
// first two radial coefficients.
inline constexpr int kIntrinsics = 5;
using IntrinsicsStep = Eigen::Matrix<double, kIntrinsics, 1>;

Camera WithIntrinsicsStep(const Camera& camera, const IntrinsicsStep& step);

// A pixel of the original (distorted) image with its derivatives.
struct PixelDerivatives {
  Eigen::Vector2d px;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, kIntrinsics> by_intrinsics;
};

// The pixel at which a camera sees a point; z must be above zero.
Eigen::Vector2d PixelOf(const Camera& camera, const Eigen::Vector3d& x_in_cam);
PixelDerivatives PixelWithDerivatives(const Camera& camera, const Eigen::Vector3d& x_in_cam);

}  // namespace oaslam
