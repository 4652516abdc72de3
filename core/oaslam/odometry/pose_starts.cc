#include "oaslam/odometry/pose_starts.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "oaslam/estimation/huber.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/geometry/skew.h"

namespace oaslam {

Eigen::Matrix3d RotationBetween(std::span<const Eigen::Vector2d> first,
                                std::span<const Eigen::Vector2d> second, Eigen::Matrix3d start) {
  constexpr int kIterations = 12;
  // rad: from a tenth, which near points reach between two images, to what far ones have.
  constexpr double kFirst = 0.1, kLast = 0.01, kShrink = 0.7;
  double sigma = kFirst;
  for (int i = 0; i < kIterations; ++i) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (size_t k = 0; k < first.size(); ++k) {
      const Eigen::Vector3d a = first[k].homogeneous().normalized(),
                            b = second[k].homogeneous().normalized();
      const double weight = 1 / (1 + (start * a - b).squaredNorm() / (sigma * sigma));
      sum += weight * b * a.transpose();
    }
    const SingularValues svd = SingularValuesOf(sum);
    const double sign = (svd.u * svd.v.transpose()).determinant();
    start = svd.u * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.v.transpose();
    sigma = std::max(kLast, sigma * kShrink);
  }
  return start;
}

Rigid3 RefinePose(std::span<const PosePoint> points, const WindowOptions& options,
                  const PoseFitPrior& prior, double inflation, const Rigid3& start) {
  constexpr int kIterations = 14;
  constexpr double kShrink = 0.6;     // of the inflation
  constexpr double kFar2 = 25;        // beyond five sigmas a point is most likely wrong:
  constexpr double kFarWeight = 0.1;  // it counts little more
  Rigid3 pose = start;
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();
    PoseVector gradient = PoseVector::Zero();
    const double variance = std::pow(options.sigma_px * inflation / options.focal_px, 2);
    for (const PosePoint& p : points) {
      const Eigen::Vector3d by_depth = rotation * p.anchor_center + pose.translation;
      const Eigen::Vector3d x = rotation * p.direction + p.inverse_depth * by_depth;
      if (x.z() < kNearest) continue;
      const double inverse_z = 1 / x.z();
      const Eigen::Vector2d projected = x.head<2>() * inverse_z, residual = projected - p.ray;
      Eigen::Matrix<double, 2, 3> by_x;
      by_x << inverse_z, 0, -projected.x() * inverse_z, 0, inverse_z, -projected.y() * inverse_z;
      const Eigen::Vector2d along = by_x * by_depth;
      const Eigen::Matrix2d information =
          (variance * p.covariance + p.variance * along * along.transpose()).inverse();
      const double chi2 = residual.dot(information * residual);
      double weight = LossOf(chi2, options.huber_sigmas * options.huber_sigmas).weight;
      if (chi2 > kFar2) weight *= kFarWeight;
      Eigen::Matrix<double, 2, 6> by_pose;
      by_pose << p.inverse_depth * by_x, -by_x * Skew(x);
      hessian += weight * by_pose.transpose() * information * by_pose;
      gradient += weight * by_pose.transpose() * (information * residual);
    }
    // The centre moves by -R^T v: its squared distance has the information of any direction.
    const Eigen::Vector3d off = pose.OriginInSource() - prior.center;
    const double prior_information = 1 / (prior.sigma * prior.sigma);
    hessian.topLeftCorner<3, 3>().diagonal().array() += prior_information;
    gradient.head<3>() -= prior_information * (rotation * off);
    if (prior.rotation) {
      const Eigen::AngleAxisd turned(
          Eigen::Quaterniond(pose.rotation * prior.rotation->second_from_first.conjugate()));
      hessian.bottomRightCorner<3, 3>().diagonal().array() += 1 / prior.rotation->variance;
      gradient.tail<3>() += turned.angle() / prior.rotation->variance * turned.axis();
    }
    hessian.diagonal().array() += 1e-6;  // a camera without points stays
    const PoseVector step = -SolveSymmetric<6>(hessian, gradient);
    if (!step.allFinite()) break;
    pose = Moved(pose, step);
    if (inflation > 1)
      inflation = std::max(1.0, inflation * kShrink);
    else if (step.norm() < 1e-5)  // far below the noise of any track
      break;
  }
  return pose;
}

std::vector<Rigid3> PoseStarts(std::span<const PosePoint> points, const WindowOptions& options,
                               const PoseFitPrior& prior, const Rigid3& predicted,
                               const Rigid3& by_prediction, const Eigen::Matrix3d& rotation_of_flow,
                               double last_step) {
  const Eigen::Vector3d center = predicted.OriginInSource();
  const Rigid3 turned(rotation_of_flow, -(rotation_of_flow * center));
  PoseFitPrior held = prior;
  held.sigma *= 0.1;
  const std::vector<Rigid3> reached = {
      by_prediction, RefinePose(points, options, prior, kFarStart, turned),
      RefinePose(points, options, prior, 1, RefinePose(points, options, held, 20, predicted))};
  // Poses as near as this end in the same minimum.
  constexpr double kSameAngle = 0.3 * kDegree, kSameStep = 0.15;
  const double step = std::max(last_step, 0.3 * prior.sigma);
  std::vector<Rigid3> distinct;
  for (const Rigid3& pose : reached)
    if (std::ranges::none_of(distinct, [&](const Rigid3& other) {
          return pose.rotation.angularDistance(other.rotation) < kSameAngle &&
                 (pose.OriginInSource() - other.OriginInSource()).norm() < kSameStep * step;
        }))
      distinct.push_back(pose);
  return distinct;
}

}  // namespace oaslam
