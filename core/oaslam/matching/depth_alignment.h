#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What the depths of a frame say of its pose in a map whose metre is known (SigmaOfMetre).

// Landmarks in the image at a pose, whether or not they are recognized: so many that they tell the
// pose, and none that is far behind the surface that was measured there, as in the room behind a
// wall. Positions in the world. None where the frame has no depths, or the map no metre.
std::vector<Eigen::Vector3d> LandmarksBeforeDepths(const Frame& frame, const Map& map,
                                                   const Rigid3& cam_from_world);

struct AlignedPose {
  Rigid3 cam_from_world;
  PoseCovariance covariance;
};

// Moves a pose so that landmarks lie on the surfaces that were measured. Distances are those of
// points from planes (Chen and Medioni 1992), and the pose with its covariance is the prior, so
// that it decides where a wall alone leaves the pose open. Nothing where few landmarks are beside
// a surface, or most of them would be hidden. `metre_sigma`: SigmaOfMetre.
std::optional<AlignedPose> AlignToDepths(const Frame& frame,
                                         std::span<const Eigen::Vector3d> landmarks,
                                         const AlignedPose& pose, double metre_sigma);

// How many landmarks are where the depth camera measured a surface, and how many are before it, so
// that the camera sees through them. Landmarks behind a surface are hidden, and say nothing.
struct DepthAgreement {
  int agree = 0, seen_through = 0;

  bool Contradicts() const;
};
DepthAgreement CompareDepths(const Frame& frame, std::span<const Eigen::Vector3d> landmarks,
                             const AlignedPose& pose, double metre_sigma);

}  // namespace oaslam
