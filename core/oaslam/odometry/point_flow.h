#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {

// px by which a patch is moved to fit an earlier image, at most: more is another place, or a patch
// that has turned.
inline constexpr float kMaxShift = 1.5;

// A point to be followed from one image to the next.
struct PointToFollow {
  Eigen::Vector2f px;     // in the last image
  Eigen::Vector2f guess;  // in the next one
  // An earlier image and its place there; null: there is none but the last.
  const GreyPyramid* earlier = nullptr;
  Eigen::Vector2f earlier_px = Eigen::Vector2f::Zero();
};

// The places of points in the next image, nothing for those that are lost: by patches that are
// followed there and back; where many are lost, once more from the motion of those beside them; at
// last moved to fit the patch of an earlier image, so that errors do not add up from image to
// image.
std::vector<std::optional<Eigen::Vector2f>> FollowPoints(std::span<const PointToFollow> points,
                                                         const GreyPyramid& last,
                                                         const GreyPyramid& next);

}  // namespace oaslam
