#include "oaslam/odometry/inertial.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

// The bias of a phone's accelerometer: 20 to 40 mg (data sheet of Bosch's BMI160), more in old
// ones.
constexpr double kAnyBias = 0.4;          // m/s^2
constexpr double kSigmaOfGravity = 0.03;  // m/s^2: from the equator to the poles
constexpr double kOlder = 0.995;          // the weight of a triple, of that of the next one

// `metre`: its length in units, about.
double InformationOf(const KnownTriple& t, double noise, double metre) {
  return 1 / (t.sigma_images * t.sigma_images + metre * metre * noise * noise * t.seconds);
}

// The equations of the length of a metre, gravity and bias, in units of the odometry.
InertialPrior EquationsOf(std::span<const KnownTriple> triples, double noise, double metre) {
  InertialPrior equations;
  double weight = 1;
  for (size_t k = triples.size(); k-- > 0; weight *= kOlder) {
    const KnownTriple& t = triples[k];
    const Eigen::Matrix<double, 7, 3> weighted =
        weight * InformationOf(t, noise, metre) * t.by_inertial.transpose();
    equations.information += weighted * t.by_inertial;
    equations.right -= weighted * t.change;
  }
  return equations;
}

// In metres, or back: the length of a metre in units is that of a unit in metres inverted.
InertialVector Inverted(const InertialVector& x) {
  InertialVector y = x / x[0];
  y[0] = 1 / x[0];
  return y;
}

}  // namespace

InertialResidual ResidualOf(const InertialTriple& triple, const std::array<Rigid3, 3>& poses,
                            const Eigen::Vector3d& lever, const InertialVector& inertial) {
  const double first = triple.first.seconds, second = triple.second.seconds;
  const double unit = inertial[0], inverse_sigma = 1 / triple.sigma;
  // Along the axes of each camera: what its rotation turns, without a bias, and by the bias.
  const std::array<Eigen::Vector3d, 3> unbiased = {
      lever / first - (triple.first.velocity - triple.first.place / first),
      -lever * (1 / first + 1 / second) - triple.second.place / second, lever / second};
  const std::array<Eigen::Matrix3d, 3> by_bias = {
      triple.first.velocity_by_bias - triple.first.place_by_bias / first,
      triple.second.place_by_bias / second, Eigen::Matrix3d::Zero()};
  const std::array<double, 3> of_center = {1 / first, -(1 / first + 1 / second), 1 / second};
  InertialResidual residual;
  Eigen::Vector3d change = Eigen::Vector3d::Zero();  // of the camera's velocity, units/s
  residual.value = -triple.seconds() * inverse_sigma * inertial.segment<3>(1);
  residual.by_inertial.setZero();
  residual.by_inertial.block<3, 3>(0, 1).diagonal().array() = -triple.seconds() * inverse_sigma;
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::Matrix3d odom_from_cam =
        inverse_sigma * poses[i].rotation.conjugate().toRotationMatrix();
    const Eigen::Vector3d turned = unbiased[i] + by_bias[i] * inertial.tail<3>();
    change += of_center[i] * poses[i].OriginInSource();
    residual.by_center[i] = unit * inverse_sigma * of_center[i];
    residual.value += odom_from_cam * turned;
    residual.by_inertial.rightCols<3>() += odom_from_cam * by_bias[i];
    residual.by_rotation[i] = odom_from_cam * Skew(turned);
  }
  residual.by_inertial.col(0) = inverse_sigma * change;
  residual.value += unit * inverse_sigma * change;
  return residual;
}

double GravityError(const InertialVector& inertial) {
  return (inertial.segment<3>(1).norm() - kGravity) / kSigmaOfGravity;
}

InertialVector GravityDerivative(const InertialVector& inertial) {
  InertialVector derivative = InertialVector::Zero();
  const Eigen::Vector3d gravity = inertial.segment<3>(1);
  if (const double length = gravity.norm(); length > 0)
    derivative.segment<3>(1) = gravity / (length * kSigmaOfGravity);
  return derivative;
}

KnownTriple Known(const InertialTriple& triple, const std::array<Rigid3, 3>& poses,
                  const Eigen::Vector3d& lever, double center_sigma) {
  InertialTriple unit = triple;
  unit.sigma = 1;
  const InertialResidual residual = ResidualOf(unit, poses, lever, InertialVector::Zero());
  KnownTriple known{residual.by_inertial.col(0), residual.by_inertial, triple.seconds(), 0};
  known.by_inertial.col(0) = residual.value;
  const double first = 1 / triple.first.seconds, second = 1 / triple.second.seconds;
  known.sigma_images = center_sigma * std::sqrt(first * first + second * second +
                                                (first + second) * (first + second));
  return known;
}

std::optional<InertialFit> FitInertial(std::span<const KnownTriple> triples, double noise) {
  constexpr int kIterations = 6;
  constexpr size_t kLeast = 4;
  if (triples.size() < kLeast) return std::nullopt;
  // At first as if the accelerometer had no noise, and any bias.
  InertialPrior equations = EquationsOf(triples, 0, 1);
  equations.information.diagonal().array() += 1e-9 * equations.information.trace();
  InertialVector value;  // in units of the odometry
  double variance = 0;   // of the length of a metre
  for (int i = 0; i <= kIterations; ++i) {
    const Eigen::LLT<InertialMatrix> factor(equations.information);
    if (factor.info() != Eigen::Success) return std::nullopt;
    value = factor.solve(equations.right);
    const double metre = value[0];
    if (!value.allFinite() || metre == 0) return std::nullopt;
    variance = factor.solve(InertialVector::Unit(0))[0];
    if (i == kIterations) break;
    equations = EquationsOf(triples, noise, metre);
    equations.information.diagonal().tail<3>().array() += 1 / std::pow(metre * kAnyBias, 2);
    // The length of gravity, divided by that of a metre, is known.
    const double sigma = std::abs(metre) * kSigmaOfGravity, length = value.segment<3>(1).norm();
    InertialVector derivative = InertialVector::Zero();
    derivative[0] = metre > 0 ? -kGravity / sigma : kGravity / sigma;
    derivative.segment<3>(1) = value.segment<3>(1) / (std::max(length, 1e-9) * sigma);
    equations.information += derivative * derivative.transpose();
    equations.right +=
        derivative * (derivative.dot(value) - (length - kGravity * std::abs(metre)) / sigma);
  }
  double squared = 0, weights = 0, weight = 1;
  for (size_t k = triples.size(); k-- > 0; weight *= kOlder) {
    const KnownTriple& t = triples[k];
    squared += weight * InformationOf(t, noise, value[0]) *
               (t.change + t.by_inertial * value).squaredNorm();
    weights += 3 * weight;
  }
  return InertialFit{Inverted(value), std::sqrt(variance) / std::abs(value[0]), squared / weights};
}

InertialPrior PriorBy(std::span<const KnownTriple> triples, double noise,
                      const InertialVector& near) {
  const InertialVector there = Inverted(near);
  const InertialPrior equations = EquationsOf(triples, noise, there[0]);
  // The derivative of the unknowns in units of the odometry by those in metres.
  InertialMatrix derivative = there[0] * InertialMatrix::Identity();
  derivative.col(0) = -there[0] * there;
  InertialPrior prior;
  prior.information = derivative.transpose() * equations.information * derivative;
  prior.right = derivative.transpose() * (equations.right - equations.information * there) +
                prior.information * near;
  prior.information.diagonal().tail<3>().array() += 1 / (kAnyBias * kAnyBias);
  return prior;
}

}  // namespace oaslam
