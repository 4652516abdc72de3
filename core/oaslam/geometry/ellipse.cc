#include "oaslam/geometry/ellipse.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/decompositions.h"

namespace oaslam {

PrincipalAxes PrincipalAxesOf(const Eigen::Matrix2d& covariance) {
  const SymmetricEigen<2> axes = EigenOfSymmetric(covariance);
  const Eigen::Vector2d half = axes.values.cwiseMax(0).cwiseSqrt();
  const Eigen::Vector2d major = axes.vectors.col(1);
  double angle = std::atan2(major.y(), major.x());
  if (angle > std::numbers::pi / 2) angle -= std::numbers::pi;
  if (angle <= -std::numbers::pi / 2) angle += std::numbers::pi;
  return {half[1], half[0], angle};
}

Ellipse InscribedEllipse(const Box& box) {
  const Eigen::Array2d half(box.Width() / 2, box.Height() / 2);
  return {CenterPixel(box), Eigen::Vector2d(half.square()).asDiagonal()};
}

Box BoundingBox(const Ellipse& ellipse) {
  const double half_width = std::sqrt(ellipse.covariance(0, 0)),
               half_height = std::sqrt(ellipse.covariance(1, 1));
  const double x = ellipse.mean.x() + kBoxFromPixel, y = ellipse.mean.y() + kBoxFromPixel;
  return {x - half_width, y - half_height, x + half_width, y + half_height};
}

double SquaredWasserstein(const Ellipse& a, const Ellipse& b) {
  // tr (A^1/2 B A^1/2)^1/2 of 2x2 matrices is sqrt(tr AB + 2 sqrt(det A det B)).
  const double cross =
      (a.covariance * b.covariance).trace() +
      2 * std::sqrt(std::max(a.covariance.determinant() * b.covariance.determinant(), 0.0));
  return (a.mean - b.mean).squaredNorm() + a.covariance.trace() + b.covariance.trace() -
         2 * std::sqrt(std::max(cross, 0.0));
}

}  // namespace oaslam
