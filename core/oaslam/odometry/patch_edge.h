#pragma once

#include <Eigen/Core>

#include "oaslam/features/grey_image.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// How a patch on an edge is found: less surely along the edge than across it. Where the patch looks
// a little different than before (blur, another viewpoint, a reflection), the match slides along
// the edge.
struct PatchEdge {
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  // in the image, of length 1
  double slide = 1;  // sigma of a sighting along the edge, divided by that across it; 1 at a corner

  PatchEdge In(const Rigid3& image_from_here) const;
  // The covariance of a sighting, in units of the variance across the edge; and the root of its
  // inverse, symmetric.
  Eigen::Matrix2d Covariance() const;
  Eigen::Matrix2d RootOfInformation() const;
  // The length of the error of a sighting, in which a shift along the edge counts less.
  double Off(const Eigen::Vector2d& shift) const { return (RootOfInformation() * shift).norm(); }
};

// The edge at a pixel, from the structure tensor of the patch around it (Foerstner and Guelch
// 1987). Sigma along the edge is derived from the assumption that a part of each brightness change
// across the edge is mistaken for a shift along it, in proportion to the ratio of the slopes across
// and along the edge.
PatchEdge EdgeAt(const GreyImage& image, const Eigen::Vector2f& px);

}  // namespace oaslam
