#pragma once

#include <Eigen/Core>
#include <array>

#include "oaslam/rigid3.h"

namespace oaslam {

struct P3PPoses {
  std::array<Rigid3, 4> poses;  // cam_from_world
  int count = 0;
};

// The up to four camera poses that see three world points along three unit rays of the camera, each
// in front of the camera. Returns none when the points or the rays are (nearly) collinear. After
// Persson and Nordberg, "Lambda Twist" (ECCV 2018).
P3PPoses SolveP3P(const std::array<Eigen::Vector3d, 3>& unit_rays_in_cam,
                  const std::array<Eigen::Vector3d, 3>& points_in_world);

}  // namespace oaslam
