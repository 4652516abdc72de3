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

// Up as the rotations of hand-held cameras (cam_from_world, in the order of time) tell it. People
// hold cameras level, so that the images' x axes lie in the horizontal plane and up is the
// direction orthogonal to all of them; the mean of the images' y axes is not, for people look down
// at things. Robust against single views held otherwise. How far it is off: docs/results.md. A
// phone whose video is turned by 90 degrees holds its y axes level instead; that is believed only
// after about half a turn, for a camera that nods looks the same before. Nothing where the motion
// does not tell: too little of a turn for how much the camera rolls, or a turn about its own
// optical axis, which may be rolling as well as looking down.
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
