#pragma once

#include <Eigen/Core>
#include <span>

#include "oaslam/types.h"

namespace oaslam {

// The upright box around points, of which there must be one.
Box HullOf(std::span<const Eigen::Vector2d> points);

// The upright box around one that is rotated clockwise about a point; pixels.
Box RotatedHull(const Box& box, double degrees, const Eigen::Vector2d& about);

}  // namespace oaslam
