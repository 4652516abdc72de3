#pragma once

#include <Eigen/Core>
#include <span>

namespace oaslam {

// How a pose stands apart from one plane: a poster, a window or a door that also hangs elsewhere
// agrees in hundreds of points, and nothing beside it does.
struct PlaneSupport {
  int beside = 0;              // of the landmarks found, those beside the plane of most of them
  double expected_beside = 0;  // so many, were as large a share of those found as in the plane

  // Nothing, or nearly so, was found where something should be.
  bool IsOfOnePlane() const;
};

// `found` are among `expected`, which should be in view; `distance`: the median one from the camera
// to those found, in the same unit. No support where there is no plane.
PlaneSupport BesideThePlane(std::span<const Eigen::Vector3d> found,
                            std::span<const Eigen::Vector3d> expected, double distance);

// Whether next to nothing of what was found stands apart from one plane, seen from `distance`: it
// may be a window or a poster whose like hangs in another room, too.
bool IsFlat(std::span<const Eigen::Vector3d> found, double distance);

// Whether more than half of a map's landmarks lie in one plane, seen from `distance`: there is no
// other wall.
bool IsOneWall(std::span<const Eigen::Vector3d> landmarks, double distance);

}  // namespace oaslam
