#pragma once

#include <Eigen/Core>
#include <array>

#include "oaslam/rigid3.h"

namespace oaslam {

struct Up2PPoses {
  std::array<Rigid3, 2> poses;  // cam_from_world
  int count = 0;
};

// The up to two camera poses that see two world points along two rays, in front of the camera,
// where the vertical is known in both frames (unit vectors against gravity). Returns none when both
// rays are horizontal or the points lie on one vertical line.
Up2PPoses SolveUp2P(const std::array<Eigen::Vector3d, 2>& rays_in_cam,
                    const Eigen::Vector3d& up_in_cam,
                    const std::array<Eigen::Vector3d, 2>& points_in_world,
                    const Eigen::Vector3d& up_in_world);

}  // namespace oaslam
