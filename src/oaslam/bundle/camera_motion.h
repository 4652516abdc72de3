#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// What a second of the camera's motion does to a point in the camera: x' = v + w x x.
struct CameraVelocity {
  Eigen::Vector3d v = Eigen::Vector3d::Zero(), w = Eigen::Vector3d::Zero();

  Eigen::Vector3d Of(const Eigen::Vector3d& x_in_cam) const { return v + w.cross(x_in_cam); }
};

// How the camera moved, by a trajectory and the keyframes that carry it.
class CameraMotion {
 public:
  CameraMotion(const Map& map, std::span<const FramePose> trajectory);

  // By the poses before and after that of a time stamp, where there are such close by.
  std::optional<CameraVelocity> At(double timestamp) const;

 private:
  struct TimedPose {
    double timestamp = 0;
    Rigid3 cam_from_world;
  };
  std::vector<TimedPose> poses_;  // ascending
};

}  // namespace oaslam
