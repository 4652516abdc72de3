#pragma once

#include <Eigen/Core>
#include <span>
#include <stop_token>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// A point seen by a camera.
struct PointSight {
  int pose = 0, point = 0;
  Eigen::Vector2d px;  // ideal image
  double inverse_sigma = 1;
};

// Cameras and points, as far as known.
struct CamerasAndPoints {
  std::vector<Rigid3> poses;           // cam_from_world; those that may move come first
  std::vector<const Camera*> cameras;  // parallel
  std::vector<Eigen::Vector3d> points;
};

struct SchurOptions {
  int max_iterations = 10;
  double tolerance = 1e-3;  // ends with a step that lowers the cost by less than this share
  double huber_chi2 = 0;    // above it a squared error counts by Huber's kernel; 0: no kernel
  std::stop_token stop{};
};

struct SchurReport {
  bool success = false;  // false: nothing to solve, the numbers broke down, or it was asked to
                         // stop; the state is then as good as before or better
  int iterations = 0;
};

// Minimises the reprojection errors of `sights`, sorted by point, over the first `free_poses` poses
// and all points, by Levenberg-Marquardt on the Schur complement of the points, a dense system of
// the poses (Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000). For windows of some
// dozens of cameras; it has none of a general solver's costs for a residual.
SchurReport MinimizeReprojection(std::span<const PointSight> sights, int free_poses,
                                 const SchurOptions& options, CamerasAndPoints& state);

}  // namespace oaslam
