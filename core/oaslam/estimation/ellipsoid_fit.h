#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "oaslam/camera.h"
#include "oaslam/geometry/ellipsoid_jacobian.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// The box of one object seen from a known pose.
struct BoxView {
  Rigid3 cam_from_world;
  const Camera* camera = nullptr;
  Box box;                      // ideal image
  double score = 1;             // of the detector, (0, 1]
  unsigned char truncated = 0;  // EdgeBits: what lies beyond these edges is not seen
  // The number of views it counts for; 1 in a video of 30 Hz, where the errors of neighbouring
  // views are correlated.
  double weight = 1;
  // The z of the surface that it shows, where a depth camera measured it; 0: not known. Edges are
  // fitted with it, not Wasserstein distances.
  double surface = 0;
  double surface_weight = 1;  // besides `weight`
};

struct SphereEstimate {
  bool success = false;
  Ellipsoid sphere;
  double parallax_deg = 0;  // the largest angle between two rays through box centres
};

// Estimates the first model of an object (paper, section "Initial Object Reconstruction"): the
// point nearest to all rays through the box centres, with the mean back-projected size of the
// boxes. Below the parallax, by the surfaces that three or more views show; fails without these,
// and when the point is behind a camera.
SphereEstimate EstimateSphere(std::span<const BoxView> views, double min_parallax_deg);

enum class EllipsoidResidual {
  kEdges,        // box edges, robust, one-sided where truncated, with priors on the shape
                 // (docs/objects.md)
  kWasserstein,  // the paper's: the 2-Wasserstein distance of inscribed and projected ellipse, not
                 // robust
};

struct EllipsoidFitOptions {
  EllipsoidResidual residual = EllipsoidResidual::kEdges;
  // The vertical in the world: the third axis stays parallel to it (7 parameters instead of 9). For
  // kEdges only.
  std::optional<Eigen::Vector3d> up{};
  int max_iterations = 12;
};

// The overlap of an ellipsoid's projections with the boxes of its views.
struct ViewOverlap {
  double mean_iou = 0;      // over untruncated views (over all when every one is truncated)
  double accept_share = 0;  // share of all views with at least the requested IoU
};
ViewOverlap MeasureOverlap(const Ellipsoid& ellipsoid, std::span<const BoxView> views,
                           double accept_iou);

struct EllipsoidFit {
  // False: the ellipsoid is in front of no camera, or the numbers are not finite.
  bool success = false;
  Ellipsoid ellipsoid;
  double cost = 0;
};

// Fits an ellipsoid to the boxes by Levenberg-Marquardt from `start`.
EllipsoidFit FitEllipsoid(std::span<const BoxView> views, const Ellipsoid& start,
                          const EllipsoidFitOptions& options);

// Fits an ellipsoid from a sphere. The rotation about the vertical is unknown: with `up`, the
// better result of two starts that are 45 degrees apart is returned.
EllipsoidFit FitFromSphere(std::span<const BoxView> views, const Ellipsoid& sphere,
                           const EllipsoidFitOptions& options);

// Relabels the axes of an ellipsoid and rotates it so that the third axis is `up`.
Ellipsoid MakeUpright(const Ellipsoid& ellipsoid, const Eigen::Vector3d& up);

using ShapeCovariance = Eigen::Matrix<double, 7, 7>;

// Covariance of the centre, the log half axes and the rotation about the third axis. It assumes box
// edges with 4 px noise, correlated over 6 views, and the shape prior.
ShapeCovariance EstimateCovariance(const Ellipsoid& ellipsoid, std::span<const BoxView> views);

}  // namespace oaslam
