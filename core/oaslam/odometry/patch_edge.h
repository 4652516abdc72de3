#pragma once

#include <Eigen/Core>

#include "oaslam/features/grey_image.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// A patch on an edge is found less surely along the edge than across it: where it looks a little
// otherwise than before (blur, another side, a reflection), it slides.
struct PatchEdge {
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  // in the image, of length 1
  double slide = 1;  // sigma of a sighting along the edge, in those across it; 1 at a corner

  // As another image sees it.
  PatchEdge In(const Rigid3& image_from_here) const;
  // Of a sighting, in units of the variance across the edge; and the root of the inverse,
  // symmetric.
  Eigen::Matrix2d Covariance() const;
  Eigen::Matrix2d RootOfInformation() const;
  // How far a sighting is off, where a shift along the edge counts less.
  double Off(const Eigen::Vector2d& shift) const { return (RootOfInformation() * shift).norm(); }
};

// By the structure tensor of the patch about this pixel (Foerstner and Guelch 1987): what changes
// across the edge is taken for a shift along it in the ratio of the slopes there.
PatchEdge EdgeAt(const GreyImage& image, const Eigen::Vector2f& px);

}  // namespace oaslam
