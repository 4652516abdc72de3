#pragma once

#include <Eigen/Core>

#include "oaslam/types.h"

namespace oaslam {

// {x : (x - mean)^T covariance^-1 (x - mean) <= 1} in pixels.
struct Ellipse {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};

// The square roots of a covariance's eigenvalues, in its unit: the half axes of an Ellipse; and the
// direction of the larger one, from the x axis towards the y axis.
struct PrincipalAxes {
  double major = 0, minor = 0;
  double angle_rad = 0;  // in (-pi/2, pi/2]
};
PrincipalAxes PrincipalAxesOf(const Eigen::Matrix2d& covariance);

// The axis-aligned ellipse inscribed in a box.
Ellipse InscribedEllipse(const Box& box);

// mean +- sqrt(diagonal of the covariance), which needs no decomposition.
Box BoundingBox(const Ellipse& ellipse);

// The squared 2-Wasserstein distance of the Gaussians N(mean, covariance), px^2.
double SquaredWasserstein(const Ellipse& a, const Ellipse& b);

}  // namespace oaslam
