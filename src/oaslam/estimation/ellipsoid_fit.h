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
  double weight =
      1;  // as how many views it counts; 1: of a video of 30 Hz, where neighbours err alike
};

struct SphereEstimate {
  bool success = false;
  Ellipsoid sphere;
  double parallax_deg = 0;  // the largest angle between two rays through box centres
};

// The first model of an object (paper, section "Initial Object Reconstruction"): the point nearest
// to all rays through the box centres, with the mean back-projected box size. Fails below the
// parallax, or when the point is behind a camera.
SphereEstimate EstimateSphere(std::span<const BoxView> views, double min_parallax_deg);

enum class EllipsoidResidual {
  kEdges,        // box edges, robust, one-sided where truncated, with priors on the shape
                 // (docs/objects.md)
  kWasserstein,  // the paper's: the 2-Wasserstein distance of inscribed and projected ellipse, not
                 // robust
};

struct EllipsoidFitOptions {
  EllipsoidResidual residual = EllipsoidResidual::kEdges;
  std::optional<Eigen::Vector3d>
      up{};  // world; the third axis stays upright (7 parameters instead of 9). Edges only.
  int max_iterations = 12;
};

// Overlap of an ellipsoid's projections with the boxes it was seen as.
struct ViewOverlap {
  double mean_iou = 0;      // over untruncated views (over all when every one is truncated)
  double accept_share = 0;  // of all views with at least the asked IoU
};
ViewOverlap MeasureOverlap(const Ellipsoid& ellipsoid, std::span<const BoxView> views,
                           double accept_iou);

struct EllipsoidFit {
  bool success = false;  // false: no view has it in front of the camera, or the numbers broke down
  Ellipsoid ellipsoid;
  double cost = 0;
};

// The ellipsoid with the smallest residuals, by Levenberg-Marquardt from `start`.
EllipsoidFit FitEllipsoid(std::span<const BoxView> views, const Ellipsoid& start,
                          const EllipsoidFitOptions& options);

// From a first model, whose turn about the vertical is unknown: the better of two starts 45 deg
// apart where there is an `up`.
EllipsoidFit FitFromSphere(std::span<const BoxView> views, const Ellipsoid& sphere,
                           const EllipsoidFitOptions& options);

// The same ellipsoid, its axes relabelled and turned so that the third is `up`.
Ellipsoid MakeUpright(const Ellipsoid& ellipsoid, const Eigen::Vector3d& up);

using ShapeCovariance = Eigen::Matrix<double, 7, 7>;

// Covariance of centre, log half axes and rotation about the third axis, of box edges with 4 px
// noise that is correlated over 6 views, and of the shape prior.
ShapeCovariance EstimateCovariance(const Ellipsoid& ellipsoid, std::span<const BoxView> views);

}  // namespace oaslam
