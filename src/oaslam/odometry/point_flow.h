#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {

// A point to be followed from one image to the next.
struct PointToFollow {
  Eigen::Vector2f px;                            // in the last image
  Eigen::Vector2f guess;                         // in the next one
  const Eigen::Vector2f* keyframe_px = nullptr;  // null: the keyframe does not see it
};

// The places of points in the next image, nothing for those that are lost: by patches that are
// followed there and back; where many are lost, once more from the motion of those beside them; at
// last moved to fit the patch of the keyframe, so that errors do not add up from image to image.
// `keyframe`: null where it is the last image itself.
std::vector<std::optional<Eigen::Vector2f>> FollowPoints(std::span<const PointToFollow> points,
                                                         const GreyPyramid& last,
                                                         const GreyPyramid* keyframe,
                                                         const GreyPyramid& next);

}  // namespace oaslam
