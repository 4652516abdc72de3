#include "oaslam/estimation/two_view_refinement.h"

#include <array>
#include <cmath>
#include <numbers>

#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;

// Two directions orthogonal to t and to each other.
Eigen::Matrix<double, 3, 2> Tangents(const Eigen::Vector3d& t) {
  const Eigen::Vector3d u = t.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> basis;
  basis << u, t.cross(u);
  return basis;
}

// A unit translation moves on the sphere.
std::optional<Rigid3> MovedMotion(const Rigid3& motion, const Vector5d& step) {
  const Eigen::Vector3d t = motion.translation + Tangents(motion.translation) * step.head<2>();
  return Rigid3((RotationOf(step.tail<3>()) * motion.rotation).normalized(), t.normalized());
}

NormalEquations<5> Linearize(const RayMatches& m, const Rigid3& motion) {
  const Eigen::Matrix3d r = motion.rotation.toRotationMatrix(), t_hat = Skew(motion.translation),
                        e = t_hat * r;
  const Eigen::Matrix<double, 3, 2> tangents = Tangents(motion.translation);
  std::array<Eigen::Matrix3d, 5> derivative;  // of E by the tangents of t and a left rotation
  for (int k = 0; k < 2; ++k) derivative[k] = Skew(tangents.col(k)) * r;
  for (int k = 0; k < 3; ++k) derivative[2 + k] = t_hat * Skew(Eigen::Vector3d::Unit(k)) * r;

  const double w_first = 1 / (m.focal_first * m.focal_first),
               w_second = 1 / (m.focal_second * m.focal_second);
  constexpr double kernel2 = 4;  // Cauchy: full weight well within two sigma
  NormalEquations<5> n;
  for (int i = 0; i < m.size(); ++i) {
    const Eigen::Vector3d &x = m.first[i], &y = m.second[i];
    const Eigen::Vector3d ex = e * x, ey = e.transpose() * y;
    const double variance =
        w_second * ex.head<2>().squaredNorm() + w_first * ey.head<2>().squaredNorm();
    if (!(variance > 1e-18)) continue;
    const double inverse_norm = 1 / std::sqrt(variance), inverse_sigma = inverse_norm / m.sigma[i];
    const double residual = y.dot(ex) * inverse_sigma;
    Vector5d j;
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector3d dx = derivative[k] * x, dy = derivative[k].transpose() * y;
      const double half_dvariance =
          w_second * ex.head<2>().dot(dx.head<2>()) + w_first * ey.head<2>().dot(dy.head<2>());
      j(k) = inverse_sigma * y.dot(dx) - residual * inverse_norm * inverse_norm * half_dvariance;
    }
    const double weight = 1 / (1 + residual * residual / kernel2);
    n.cost += kernel2 * std::log1p(residual * residual / kernel2);
    n.hessian.noalias() += weight * j * j.transpose();
    n.gradient.noalias() += weight * residual * j;
  }
  return n;
}

}  // namespace

Eigen::Matrix3d EssentialOf(const Rigid3& second_from_first) {
  return Skew(second_from_first.translation) * second_from_first.rotation.toRotationMatrix();
}

double SquaredSampson(const RayMatches& m, const Eigen::Matrix3d& essential, int i) {
  const Eigen::Vector3d ex = essential * m.first[i], ey = essential.transpose() * m.second[i];
  const double algebraic = m.second[i].dot(ex);
  return algebraic * algebraic /
         (ex.head<2>().squaredNorm() / (m.focal_second * m.focal_second) +
          ey.head<2>().squaredNorm() / (m.focal_first * m.focal_first));
}

RefinedMotion RefineMotion(const RayMatches& matches, const Rigid3& start) {
  RefinedMotion result{start, 0};
  const NormalEquations<5> end = MinimizeDense<5>(
      {.tolerance = 1e-5}, result.second_from_first,
      [&](const Rigid3& motion) { return Linearize(matches, motion); }, MovedMotion);
  const Eigen::Matrix<double, 5, 5> covariance = InverseOfSymmetric<5>(end.hessian);
  const Eigen::Matrix2d direction = covariance.topLeftCorner<2, 2>();
  const double variance = EigenOfSymmetric(direction).values(1);
  const double sigma_deg = std::sqrt(variance) * 180 / std::numbers::pi;
  // 180 degrees also where the estimate is not finite.
  result.direction_sigma_deg = sigma_deg >= 0 && sigma_deg < 180 ? sigma_deg : 180;
  return result;
}

}  // namespace oaslam
