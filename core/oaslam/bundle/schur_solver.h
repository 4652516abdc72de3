#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "oaslam/bundle/motion_cost.h"
#include "oaslam/camera.h"
#include "oaslam/estimation/schur_options.h"
#include "oaslam/features/depth_map.h"
#include "oaslam/rigid3.h"

namespace oaslam {

struct PointMeasurement {
  int pose = 0, point = 0;
  Eigen::Vector2d px;  // ideal image
  double inverse_sigma = 1;
  MeasuredDepth depth{};  // in the unit of the points; z 0: none
};

// The present estimates of cameras and points.
struct CamerasAndPoints {
  std::vector<Rigid3> poses;           // cam_from_world; the free ones come first
  std::vector<const Camera*> cameras;  // parallel
  std::vector<Eigen::Vector3d> points;
};

// Minimises the errors of reprojection and depth of `measurements`, sorted by point, and the errors
// of `motions` between poses, over the first `free_poses` poses and all points: Levenberg-Marquardt
// on the Schur complement of the points, a dense system of the poses (Triggs et al., "Bundle
// Adjustment - A Modern Synthesis", 2000). It is meant for windows of some dozens of cameras, and
// is faster there than a general solver.
MinimizationReport MinimizeReprojection(std::span<const PointMeasurement> measurements,
                                        int free_poses, const SchurOptions& options,
                                        CamerasAndPoints& state,
                                        std::span<const MotionMeasurement> motions = {});

}  // namespace oaslam
