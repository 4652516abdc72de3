#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdlib>
#include <deque>
#include <optional>
#include <span>

#include "oaslam/odometry/accelerometer.h"

namespace oaslam {

// What ties the accelerations of an IMU to the images of a window: the length of the odometry's
// unit in metres; gravity (3), m/s^2, in the odometry's frame; the accelerometer's bias (3), m/s^2,
// along the camera's axes. The change of the camera's velocity over three images is linear in
// these.
using InertialVector = Eigen::Matrix<double, 7, 1>;
using InertialMatrix = Eigen::Matrix<double, 7, 7>;

// Three images in the order of their times, with what the accelerometer measured between them. The
// velocities, which are not unknowns, are eliminated (Mur-Artal and Tardos, "Visual-Inertial
// Monocular SLAM with Map Reuse", 2017). Triples that overlap share noise; it is taken to be
// independent, which leaves the information on motions that are slow against the images as it is.
struct InertialTriple {
  int before = 0, middle = 0, after = 0;  // poses
  Push first, second;                     // from `before`, from `middle`
  double sigma = 1;                       // of the change of velocity, m/s

  double seconds() const { return 0.5 * (first.seconds + second.seconds); }
};

// The residual of a triple in units of its sigma, and its derivatives.
struct InertialResidual {
  Eigen::Vector3d value;
  Eigen::Matrix<double, 3, 7> by_inertial;
  std::array<double, 3> by_center;             // the same along all axes
  std::array<Eigen::Matrix3d, 3> by_rotation;  // by a rotation of the camera from the left
};

// `poses`: cam_from_odom of the three images. `lever`: the IMU in the camera's frame, metres.
InertialResidual ResidualOf(const InertialTriple& triple, const std::array<Rigid3, 3>& poses,
                            const Eigen::Vector3d& lever, const InertialVector& inertial);

inline constexpr double kGravity = 9.81;  // m/s^2
// Gravity is as long as that: the residual in units of its sigma, and its derivative.
double GravityError(const InertialVector& inertial);
InertialVector GravityDerivative(const InertialVector& inertial);

// The normal equations of the inertial unknowns: what is known of them besides the triples.
struct InertialPrior {
  InertialMatrix information = InertialMatrix::Zero();
  InertialVector right = InertialVector::Zero();

  double CostOf(const InertialVector& x) const {
    return x.dot(information * x - 2 * right);  // but for a constant
  }
};

// The inertial part of a window.
struct WindowInertial {
  InertialVector value = InertialVector::Zero();
  InertialPrior prior;  // by the images before the window
  Eigen::Vector3d lever = Eigen::Vector3d::Zero();
  double noise = 0;  // of the accelerometer, m/s of the change of velocity in a second
};

// m/s, of the change of velocity in a second: of a hand-held phone. It is learned from the images.
inline constexpr double kUsualAccelerationNoise = 0.02;

// The stated sigma of the metre, of that of the normal equations: errors of sightings are alike
// from image to image. In four walks and two flights the metre is off by .6 to 2.4 % where these
// say .4 to 1 %.
inline constexpr double kOfMetreSigma = 2.5;

// A triple of known poses, in units of the odometry: `change` plus by_inertial times (the length of
// a metre, gravity, bias) is 0. The error of the images is that of `change`, and is not multiplied
// with an unknown, which would draw the least squares towards a unit of another length.
struct KnownTriple {
  Eigen::Vector3d change;  // of the velocity, units/s
  Eigen::Matrix<double, 3, 7> by_inertial;
  double seconds = 0;
  double sigma_images = 0;  // of `change`
};
// `center_sigma`: standard deviation of a camera's centre, units.
KnownTriple Known(const InertialTriple& triple, const std::array<Rigid3, 3>& poses,
                  const Eigen::Vector3d& lever, double center_sigma);

// The least squares over triples of known poses, the later of which count more.
struct InertialFit {
  InertialVector value = InertialVector::Zero();
  double sigma_unit = 0;  // standard deviation of the length of the unit, divided by it
  double chi2 = 0;        // mean squared residual of an axis, in sigmas
};
// Nothing where they do not determine the length of the unit. It is negative where the
// accelerations have the opposite sign. `noise`: of the accelerometer.
std::optional<InertialFit> FitInertial(std::span<const KnownTriple> triples, double noise);
// What triples tell near a solution, with what holds for any accelerometer's bias.
InertialPrior PriorBy(std::span<const KnownTriple> triples, double noise,
                      const InertialVector& near);

}  // namespace oaslam
