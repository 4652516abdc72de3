#pragma once

#include <Eigen/Core>
#include <span>

namespace oaslam {

// The evidence for a pose beside the main plane of its landmarks. A copy of a poster, a window or a
// door may hang elsewhere: hundreds of landmarks in its plane then agree with a wrong pose, but no
// landmark beside the plane does.
struct PlaneSupport {
  int beside = 0;              // landmarks found beside the plane of most of them
  double expected_beside = 0;  // their number at the share of landmarks found in the plane

  // Whether landmarks are expected beside the plane, and (almost) none was found there.
  bool IsOfOnePlane() const;
};

// `found`: the landmarks found, out of those `expected` in view; `distance`: the median distance
// from the camera to those found, in the same unit. No support where there is no plane.
PlaneSupport BesideThePlane(std::span<const Eigen::Vector3d> found,
                            std::span<const Eigen::Vector3d> expected, double distance);

// Whether almost all landmarks found lie in one plane, seen from `distance`: the plane may be a
// window or a poster of which a copy hangs in another room.
bool IsFlat(std::span<const Eigen::Vector3d> found, double distance);

// Whether more than half of a map's landmarks lie in one plane, seen from `distance`: the map then
// has no other wall.
bool IsOneWall(std::span<const Eigen::Vector3d> landmarks, double distance);

}  // namespace oaslam
