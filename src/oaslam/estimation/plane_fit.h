#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/util/rng.h"

namespace oaslam {

struct PlaneFit {
  Eigen::Hyperplane<double, 3> plane;  // normal towards the viewpoint
  std::vector<int> inliers;            // indices into the points
};

// The plane through most of the points, by RANSAC and least squares. `tolerance`: of a point's
// distance to the viewpoint, as triangulation is less sure farther away. Planes seen at a grazing
// angle are none. Nothing where fewer than three points agree.
std::optional<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points,
                                 const Eigen::Vector3d& viewpoint, double tolerance, Rng& rng);

}  // namespace oaslam
