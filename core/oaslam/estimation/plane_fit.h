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

// Fits a plane to most of the points by RANSAC and least squares. `tolerance`: as a share of a
// point's distance to the viewpoint, since triangulation is less accurate farther away. Planes seen
// at a grazing angle are rejected. Returns nothing where fewer than three points agree.
std::optional<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points,
                                 const Eigen::Vector3d& viewpoint, double tolerance, Rng& rng);

}  // namespace oaslam
