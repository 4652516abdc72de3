#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "oaslam/estimation/ellipsoid_fit.h"

namespace oaslam {

// Quadratic model of the robust cost at an ellipsoid: cost + 2 gradient^T x + x^T hessian x.
struct EllipsoidEquations {
  Eigen::Matrix<double, kShapeParameters, kShapeParameters> hessian =
      Eigen::Matrix<double, kShapeParameters, kShapeParameters>::Zero();
  ShapeVector gradient = ShapeVector::Zero();
  double cost = 0;
  int in_front = 0;  // number of views with the ellipsoid in front
};

// Predicted minus detected box edges, px; 0 at a truncated edge that the prediction passes.
Eigen::Vector4d EdgeResidual(const Box& predicted, const Box& detected, unsigned char truncated);

// Six smooth numbers whose squares sum to W2^2 of the inscribed ellipse of the box and the
// projected one: mean difference, and vec(S1^-1/2 M^1/2 - S1^1/2) with M = S1^1/2 S2 S1^1/2. The
// paper minimises W2^2; Gauss-Newton methods need it as such a sum of squares.
using WassersteinVector = Eigen::Matrix<double, 6, 1>;
struct WassersteinResidual {
  WassersteinVector value;
  // Derivatives by mean x, y and covariance xx, xy, yy of the projected ellipse.
  Eigen::Matrix<double, 6, 5> by_moments;
};
WassersteinResidual ComputeWasserstein(const Ellipse& detected, const Ellipse& projected);

// How much the surface of an ellipsoid is nearer than its centre, in half axes along the view: the
// median of a sphere.
constexpr double kFrontOfCenter = 0.7;
// The depth of the surface of an ellipsoid as a camera sees it.
struct SurfaceDepth {
  double z = 0, half_axis = 0;                        // that along the view
  Eigen::Vector3d along = Eigen::Vector3d::Zero();    // the camera's z axis, world
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();  // of the half axes along the view
};
SurfaceDepth SurfaceDepthOf(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world);
// The standard deviation of a measured depth of a surface as that of an ellipsoid: things are no
// ellipsoids, so that the surface is off by a share of the half axis along the view.
double SigmaOfSurface(double half_axis, double measured);
// The depth of the ellipsoid's surface minus the one that was measured, weighed as detector pixels;
// nothing where none was measured, or the box is cut.
struct SurfaceResidual {
  double value = 0;
  ShapeVector by_shape = ShapeVector::Zero();
};
std::optional<SurfaceResidual> SurfaceResidualOf(const BoxView& view, const Ellipsoid& ellipsoid);

EllipsoidEquations Linearize(std::span<const BoxView> views, const Ellipsoid& ellipsoid,
                             const EllipsoidFitOptions& options);

// The cost alone.
double EvaluateCost(std::span<const BoxView> views, const Ellipsoid& ellipsoid,
                    const EllipsoidFitOptions& options);

// Rows of the shape prior on the log half axes, in detector pixels: their deviations from their
// mean and, with `horizontal_pair`, the difference of the first two.
Eigen::Matrix<double, 4, 3> ShapePriorRows(double weight_px, bool horizontal_pair);

// In detector pixels (DetectorPixel), in which residuals of boxes are weighed.
// Sigma of a log axis is about 1/3 where a box edge has 10 px of noise.
constexpr double kPriorWeightPx = 30;
constexpr double kHuberPx = 10;  // 2.5 sigma of a box's edge (4): beyond it an edge is an outlier

}  // namespace oaslam
