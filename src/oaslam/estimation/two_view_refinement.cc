#include "oaslam/estimation/two_view_refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <numbers>

#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

// Two directions orthogonal to t and to each other.
Eigen::Matrix<double, 3, 2> Tangents(const Eigen::Vector3d& t) {
  const Eigen::Vector3d u = t.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> basis;
  basis << u, t.cross(u);
  return basis;
}

Rigid3 Moved(const Rigid3& motion, const Vector5d& step) {
  const Eigen::Vector3d w = step.tail<3>(),
                        t = motion.translation + Tangents(motion.translation) * step.head<2>();
  const double angle = w.norm();
  const Eigen::Quaterniond turn = angle < 1e-12
                                      ? Eigen::Quaterniond::Identity()
                                      : Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle));
  return {(turn * motion.rotation).normalized(), t.normalized()};
}

struct NormalEquations {
  Matrix5d hessian = Matrix5d::Zero();
  Vector5d gradient = Vector5d::Zero();
  double cost = 0;
};

NormalEquations Linearize(const RayMatches& m, const Rigid3& motion) {
  const Eigen::Matrix3d r = motion.rotation.toRotationMatrix(), t_hat = Skew(motion.translation),
                        e = t_hat * r;
  const Eigen::Matrix<double, 3, 2> tangents = Tangents(motion.translation);
  std::array<Eigen::Matrix3d, 5> derivative;  // of E by the tangents of t and a left rotation
  for (int k = 0; k < 2; ++k) derivative[k] = Skew(tangents.col(k)) * r;
  for (int k = 0; k < 3; ++k) derivative[2 + k] = t_hat * Skew(Eigen::Vector3d::Unit(k)) * r;

  const double w_first = 1 / (m.focal_first * m.focal_first),
               w_second = 1 / (m.focal_second * m.focal_second);
  constexpr double kernel2 = 4;  // Cauchy: full weight well within two sigma
  NormalEquations n;
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
  NormalEquations here = Linearize(matches, start);
  double damping = 1e-4;
  for (int i = 0; i < 20; ++i) {
    Matrix5d damped = here.hessian;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12;
    const Vector5d step = damped.ldlt().solve(-here.gradient);
    if (!step.allFinite()) break;
    const Rigid3 moved = Moved(result.second_from_first, step);
    const NormalEquations there = Linearize(matches, moved);
    if (there.cost > here.cost) {
      damping *= 10;
      if (damping > 1e6) break;
      continue;
    }
    const bool converged = here.cost - there.cost < 1e-5 * here.cost;
    result.second_from_first = moved;
    here = there;
    damping *= 0.1;
    if (converged) break;
  }
  const Matrix5d covariance = here.hessian.ldlt().solve(Matrix5d::Identity());
  const Eigen::Matrix2d direction = covariance.topLeftCorner<2, 2>();
  const double variance =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(direction).eigenvalues()(1);
  const double sigma_deg = std::sqrt(variance) * 180 / std::numbers::pi;
  // 180 degrees also where the estimate is not finite.
  result.direction_sigma_deg = sigma_deg >= 0 && sigma_deg < 180 ? sigma_deg : 180;
  return result;
}

}  // namespace oaslam
