#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The velocity of a static point in the camera's frame: x' = v + w x x.
struct CameraVelocity {
  Eigen::Vector3d v = Eigen::Vector3d::Zero(), w = Eigen::Vector3d::Zero();

  Eigen::Vector3d Of(const Eigen::Vector3d& x_in_cam) const { return v + w.cross(x_in_cam); }
};

// The motion of the camera, from a trajectory and the keyframes that its poses are relative to.
class CameraMotion {
 public:
  CameraMotion(const Map& map, std::span<const FramePose> trajectory);

  // The velocity at a time stamp, from the poses just before and after it; nothing where there are
  // none close by.
  std::optional<CameraVelocity> At(double timestamp) const;

 private:
  struct TimedPose {
    double timestamp = 0;
    Rigid3 cam_from_world;
  };
  std::vector<TimedPose> poses_;  // ascending
};

}  // namespace oaslam
