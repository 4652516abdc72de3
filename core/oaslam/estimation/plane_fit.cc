#include "oaslam/estimation/plane_fit.h"

#include <cmath>

#include "oaslam/geometry/decompositions.h"

namespace oaslam {
namespace {

using Plane = Eigen::Hyperplane<double, 3>;

Plane Towards(const Eigen::Vector3d& viewpoint, Plane plane) {
  if (plane.signedDistance(viewpoint) < 0) plane.coeffs() *= -1;
  return plane;
}

bool IsGrazing(const Plane& plane, const Eigen::Vector3d& viewpoint, const Eigen::Vector3d& point) {
  constexpr double kMinSine = 0.1;  // 6 degrees: depths would be ten times as wrong as heights
  return std::abs(plane.normal().dot((point - viewpoint).normalized())) < kMinSine;
}

std::vector<int> InliersOf(const Plane& plane, std::span<const Eigen::Vector3d> points,
                           const Eigen::Vector3d& viewpoint, double tolerance) {
  std::vector<int> inliers;
  for (size_t i = 0; i < points.size(); ++i)
    if (plane.absDistance(points[i]) <= tolerance * (points[i] - viewpoint).norm())
      inliers.push_back(static_cast<int>(i));
  return inliers;
}

Plane LeastSquares(std::span<const Eigen::Vector3d> points, const std::vector<int>& inliers) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int i : inliers) mean += points[i];
  mean /= static_cast<double>(inliers.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const int i : inliers) scatter += (points[i] - mean) * (points[i] - mean).transpose();
  return {EigenOfSymmetric(scatter).vectors.col(0), mean};
}

}  // namespace

std::optional<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points,
                                 const Eigen::Vector3d& viewpoint, double tolerance, Rng& rng) {
  constexpr int kIterations = 300;     // find a plane of a fourth of the points in 99 of 100 cases
  constexpr int kMinInliers = 3;       // what determines a plane
  constexpr double kMinSpread = 1e-3;  // sine of the angle between the sides of a triple: no line
  if (points.size() < kMinInliers) return std::nullopt;
  const int n = static_cast<int>(points.size());
  PlaneFit best;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Eigen::Vector3d &a = points[rng.Index(n)], &b = points[rng.Index(n)],
                          &c = points[rng.Index(n)];
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > kMinSpread * (b - a).norm() * (c - a).norm())) continue;
    const Plane plane(normal.normalized(), a);
    if (IsGrazing(plane, viewpoint, a)) continue;
    std::vector<int> inliers = InliersOf(plane, points, viewpoint, tolerance);
    if (inliers.size() > best.inliers.size()) best = {plane, std::move(inliers)};
  }
  if (best.inliers.size() < kMinInliers) return std::nullopt;
  const Plane refined = LeastSquares(points, best.inliers);
  std::vector<int> inliers = InliersOf(refined, points, viewpoint, tolerance);
  if (inliers.size() >= best.inliers.size() &&
      !IsGrazing(refined, viewpoint, points[inliers.front()]))
    best = {refined, std::move(inliers)};
  best.plane = Towards(viewpoint, best.plane);
  return best;
}

}  // namespace oaslam
