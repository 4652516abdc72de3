#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {

// The largest shift in px of a patch that is moved to fit an earlier image: beyond it lies another
// place, or a patch that has turned.
inline constexpr float kMaxShift = 1.5;

struct PointToFollow {
  Eigen::Vector2f px;     // in the last image
  Eigen::Vector2f guess;  // in the next one
  // An earlier image and its place there; null: there is none but the last.
  const GreyPyramid* earlier = nullptr;
  Eigen::Vector2f earlier_px = Eigen::Vector2f::Zero();
};

// Tracks points into the next image; nothing for points that are lost. Patches are followed there
// and back. Where many points are lost, they are followed once more from the motion of the points
// beside them. Last, each patch is moved to fit the patch of an earlier image, so that errors do
// not add up from image to image.
std::vector<std::optional<Eigen::Vector2f>> FollowPoints(std::span<const PointToFollow> points,
                                                         const GreyPyramid& last,
                                                         const GreyPyramid& next);

}  // namespace oaslam
