#include "oaslam/exports/ros_map_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/exports/map_scene.h"
#include "oaslam/geometry/decompositions.h"

namespace oaslam {

Rigid3::Rotation RosFromWorld(const Map& map) {
  const Eigen::Matrix3d rows = ZUpFromWorld(map);  // right, forward, up
  Eigen::Matrix3d turned;
  turned << rows.row(1), -rows.row(0), rows.row(2);
  return Rigid3::Rotation(turned);
}

double RosMapFrame::Follow(const Map& map, WorldId world) {
  constexpr double kTolerance = std::numbers::pi / 180;  // rad; less is not seen
  const Rigid3::Rotation found = RosFromWorld(map);
  if (!has_begun_ || world != world_) {
    has_begun_ = true;
    world_ = world;
    rotation_ = found;
    return 0;
  }
  const Eigen::Vector3d up = rotation_ * (found.conjugate() * Eigen::Vector3d::UnitZ());
  const double angle = std::acos(std::clamp(up.z(), -1.0, 1.0));
  if (angle < kTolerance) return 0;
  rotation_ =
      (Rigid3::Rotation(TurnBetween(up, Eigen::Vector3d::UnitZ())) * rotation_).normalized();
  return angle;
}

}  // namespace oaslam
