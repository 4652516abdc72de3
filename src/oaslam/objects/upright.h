#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "oaslam/map/map.h"

namespace oaslam {

// The vertical of the world.
struct Upright {
  Eigen::Vector3d up;    // against gravity, unit length
  double sigma_rad = 0;  // of its tilt, 1 sigma
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

// What a sensor says of gravity from a camera.
struct GravityView {
  Eigen::Matrix3d cam_from_world;
  Eigen::Vector3d gravity_in_cam;  // any length, not zero
};

// Up as the gravity of several views tells it, three at least. Views whose length differs from the
// others' were shaken, and count less; so do those that disagree in direction. Nothing where they
// do not agree at all.
std::optional<Upright> UprightFromGravity(std::span<const GravityView> views);

// Brings Map::up up to date: from the keyframes with measured gravity, else as its keyframes were
// held. A vertical that was measured before, in the file of a loaded map, stays until as many
// keyframes (20 suffice) tell it anew.
void UpdateUp(Map& map);

}  // namespace oaslam
