#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {

// Sparse optical flow: the place of a patch of 16 x 16 pixels in another image (Lucas and Kanade
// 1981, over a pyramid as in Bouguet 2001, with the derivatives of the first image as in Baker and
// Matthews 2004). A difference in brightness of the two patches does not matter.
struct FlowOptions {
  int levels =
      5;  // of the pyramids, from the lowest on; at the fifth, 8 px are 128 px of the image
  // Pixels of the lowest level: a step this small ends the search, below the noise of any camera.
  double tolerance = 0.02;
  int max_iterations = 20;  // at each level: ends a search that does not converge
};

// The place in `second` of what is at `px` in `first`, near `guess`; nothing where it leaves the
// image, where the patch has no texture to hold it, or where the search does not settle.
std::optional<Eigen::Vector2f> FollowPatch(const GreyPyramid& first, const GreyPyramid& second,
                                           const Eigen::Vector2f& px, const Eigen::Vector2f& guess,
                                           const FlowOptions& options);

// FollowPatch there and back: nothing where it does not come back to within `max_return_px`.
std::optional<Eigen::Vector2f> FollowPatchBothWays(
    const GreyPyramid& first, const GreyPyramid& second, const Eigen::Vector2f& px,
    const Eigen::Vector2f& guess, const FlowOptions& options, double max_return_px);

}  // namespace oaslam
