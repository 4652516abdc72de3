#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/rigid3.h"

namespace oaslam {

struct TriangulatedPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // in the frame given by the function
  double cos_parallax = 1;                          // cosine of the angle between the two rays
};

// Triangulates a point from two rays (of any length) by the inverse-depth weighted midpoint
// (Lee & Civera 2019, "Triangulation: why optimize?"), which is near to the optimum at low
// parallax, too. Returns it in the first camera's frame; nothing for parallel rays or where a
// depth would be negative.
std::optional<TriangulatedPoint> TriangulateRays(const Rigid3& second_from_first,
                                                 const Eigen::Vector3d& ray_first,
                                                 const Eigen::Vector3d& ray_second);

// Triangulates a point from two rays and returns it in the world's frame.
std::optional<TriangulatedPoint> TriangulateRays(const Rigid3& first_from_world,
                                                 const Rigid3& second_from_world,
                                                 const Eigen::Vector3d& ray_first,
                                                 const Eigen::Vector3d& ray_second);

}  // namespace oaslam
