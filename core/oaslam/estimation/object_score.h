#pragma once

#include <Eigen/Core>

#include "oaslam/camera.h"
#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/geometry/ellipsoid_jacobian.h"
#include "oaslam/types.h"

namespace oaslam {

// The log-likelihood ratio that a detected box shows a given object rather than something else:
//   L = max(0, ln(W H (250 u)^2) - sum over the edges [ ln(2 s_e) + min(|r_e| / s_e, 6) ]),
//   s_e^2 = (2 u + 0.06 size)^2 + model variance_e.
// It compares a Laplace density of the edges with a uniform density of place and size;
// docs/objects.md ("From ellipsoids to a pose") describes its use. u, the size of a detector pixel
// (DetectorPixel), makes it independent of the image's resolution.
class ObjectScore {
 public:
  explicit ObjectScore(const Camera& camera);

  // sqrt(detector variance) of each edge of a box, px.
  double DetectorSigma(const Box& detected) const;

  // r_e is 0 at a truncated edge that the prediction passes.
  double operator()(const Box& detected, unsigned char truncated, const Box& predicted,
                    const Eigen::Vector4d& edge_variance) const;

  // The score with one variance for all edges, which is faster.
  double WithCommonVariance(const Box& detected, unsigned char truncated, const Box& predicted,
                            double edge_variance) const;

  double pixel_unit() const { return pixel_unit_; }

 private:
  double pixel_unit_;  // u
  double log_background_;
};

// The variance of the predicted edges due to the uncertainty of the object's model, px^2.
Eigen::Vector4d EdgeVariance(const EllipsoidView& view, const Camera& camera,
                             const ShapeCovariance& covariance);

}  // namespace oaslam
