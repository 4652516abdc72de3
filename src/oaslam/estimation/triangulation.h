#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/rigid3.h"

namespace oaslam {

struct TriangulatedPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // in the frame that the function says
  double cos_parallax = 1;                          // of the angle between the two rays
};

// The point on two rays (any length) by the inverse-depth weighted midpoint (Lee & Civera 2019,
// "Triangulation: why optimize?"), which is close to the optimum at low parallax too. In the first
// camera's frame. Nothing for parallel rays, or where a depth along a ray would have to be
// negative.
std::optional<TriangulatedPoint> TriangulateRays(const Rigid3& second_from_first,
                                                 const Eigen::Vector3d& ray_first,
                                                 const Eigen::Vector3d& ray_second);

// The same in the world.
std::optional<TriangulatedPoint> TriangulateRays(const Rigid3& first_from_world,
                                                 const Rigid3& second_from_world,
                                                 const Eigen::Vector3d& ray_first,
                                                 const Eigen::Vector3d& ray_second);

}  // namespace oaslam
