#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "oaslam/map/map.h"

namespace oaslam {

// The vertical of the world.
struct Upright {
  Eigen::Vector3d up;    // against gravity, unit length
  double sigma_rad = 0;  // of the tilt, 1 sigma
};

// Estimates the vertical from the rotations of a hand-held camera (cam_from_world, in the order of
// time). People hold cameras level, so that the x axes of the images are horizontal and up is the
// direction orthogonal to all of them. (The mean of the images' y axes is not the vertical, since
// people look down at things.) Robust against single views that are held otherwise (errors:
// docs/lab/objects.md). Where a phone's video is turned by 90 degrees, the y axes are level; that
// is accepted only after about half a turn, since before that a camera that nods looks the same.
// Returns nothing where the motion does not determine the vertical: the camera turned too little
// for how much it rolled, or turned about its own optical axis.
std::optional<Upright> UprightOf(std::span<const Eigen::Matrix3d> cameras);

// Gravity measured in a camera's frame.
struct GravityView {
  Eigen::Matrix3d cam_from_world;
  Eigen::Vector3d gravity_in_cam;  // any length, not zero
};

// Estimates the vertical from the measured gravity of at least three views. Views whose length
// differs from the median were shaken and count less, as do those whose direction disagrees.
// Returns nothing where they do not agree.
std::optional<Upright> UprightFromGravity(std::span<const GravityView> views);

// Updates Map::up: from the keyframes with measured gravity, else from how the camera was held. A
// vertical that was measured before, as in a loaded map, is kept until as many keyframes (20
// suffice) measure it again.
void UpdateUp(Map& map);

}  // namespace oaslam
