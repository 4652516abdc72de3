#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/features/grey_image.h"

namespace oaslam {

// Where a patch of one image lies in another, seen from elsewhere: its pixel at `offset` from its
// middle is at px + stretch * offset.
struct PatchPose {
  Eigen::Vector2f px = Eigen::Vector2f::Zero();
  Eigen::Matrix2f stretch = Eigen::Matrix2f::Identity();
};

struct PatchFit {
  PatchPose pose;
  double correlation = 0;  // of the two patches' grey values, at most 1
};

// Moves and stretches a patch of 10 x 10 pixels around `px` of `first` so that it fits `second`,
// from `start` on: affine (Shi and Tomasi 1994), with the derivatives of the first image (Baker and
// Matthews 2004). A patch that is only moved slides along arcs and edges when the viewpoint
// changes. Pixels near the middle count most; differences of brightness and contrast do not matter;
// the part of the stretch that the patch does not determine stays near the start. Where the start
// is too far from the true place, the correlation is 0 or less. Both images may be read kBorder
// pixels of a GreyPyramid beyond their edges. Nothing where the patch leaves an image, or has no
// contrast.
std::optional<PatchFit> FitPatch(const GreyImage& first, const Eigen::Vector2f& px,
                                 const GreyImage& second, const PatchPose& start);

}  // namespace oaslam
