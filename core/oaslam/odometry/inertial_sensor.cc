#include "oaslam/odometry/inertial_sensor.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr size_t kMostTriples = 600;
// After so many keyframes in a row the accelerations are wrong, and not the motion of the images.
constexpr int kOften = 20;

std::array<Rigid3, 3> PosesBefore(const Window& window, size_t last) {
  return {window.images[last - 2].cam_from_odom, window.images[last - 1].cam_from_odom,
          window.images[last].cam_from_odom};
}

// The standard deviation of the place of a camera beside its neighbours, units.
double CenterSigma(const WindowOptions& options, const Window& window) {
  constexpr double kPx = 0.15;  // at the median depth
  return kPx / options.focal_px / window.median_inverse_depth;
}

// How much the accelerometer's changes of velocity differ from those of the images, in sigmas: the
// median, of an axis.
double InertialMisfit(const Window& window) {
  std::vector<double> squared;
  const WindowInertial& inertial = *window.inertial;
  for (size_t i = 2; i < window.images.size(); ++i) {
    auto triple = window.images[i].is_held ? std::nullopt : TripleOf(window, i);
    if (!triple) continue;
    triple->sigma = inertial.noise * std::sqrt(triple->seconds());
    squared.push_back(ResidualOf(*triple, PosesBefore(window, i), inertial.lever, inertial.value)
                          .value.squaredNorm());
  }
  constexpr double kMedian = 2.366;  // of the squared length of three Gaussians
  return squared.empty() ? 1 : std::sqrt(Median(std::move(squared)) / kMedian);
}

}  // namespace

void InertialSensor::Replace(const Rigid3& cam_from_imu, Window& window) {
  cam_from_imu_ = cam_from_imu;
  true_axes_.setIdentity();
  is_sign_wrong_ = false;
  problem_.clear();
  gyroscope_ = Gyroscope();
  ForgetSamples(window);
}

void InertialSensor::Add(std::span<const AngularVelocity> rates, std::span<const ImuSample> samples,
                         Window& window) {
  CorrectAxes(window);
  std::vector<AngularVelocity> turned_rates(rates.begin(), rates.end());
  for (AngularVelocity& rate : turned_rates) rate.in_cam = true_axes_ * rate.in_cam;
  std::vector<ImuSample> turned(samples.begin(), samples.end());
  const Eigen::Matrix3d axes = true_axes_ * cam_from_imu_.rotation.toRotationMatrix();
  for (ImuSample& sample : turned) {
    sample.angular_velocity = axes * sample.angular_velocity;
    sample.acceleration = (is_sign_wrong_ ? -1 : 1) * (axes * sample.acceleration);
    turned_rates.push_back({sample.timestamp, sample.angular_velocity});
  }
  gyroscope_.Add(turned_rates);
  accelerometer_.Add(turned);
}

void InertialSensor::Measure(double since_s, WindowImage& image) const {
  image.turn = gyroscope_.Between(since_s, image.time_s);
  if (image.turn)
    image.push = accelerometer_.Between(since_s, image.time_s, gyroscope_.calibration());
}

void InertialSensor::Calibrate(const WindowImage& first, const WindowImage& second) {
  gyroscope_.Compare(first.time_s, second.time_s,
                     second.cam_from_odom.rotation * first.cam_from_odom.rotation.conjugate());
}

// A wrong T_cam_imu, or axes of a recorder that are named otherwise, show in the turns.
void InertialSensor::CorrectAxes(Window& window) {
  const auto better = gyroscope_.BetterAxes();
  if (!better) return;
  // The rates of a gyroscope alone come along the camera's axes.
  const Eigen::Matrix3d given = accelerometer_.IsEmpty()
                                    ? Eigen::Matrix3d::Identity()
                                    : cam_from_imu_.rotation.toRotationMatrix(),
                        found = *better * true_axes_ * given;
  constexpr double kSame = 0.35;  // of the matrices: some 15 degrees
  const double turn = Eigen::AngleAxisd(Eigen::Matrix3d(found * given.transpose())).angle();
  if ((found - given.transpose()).norm() < kSame && (given - given.transpose()).norm() > kSame) {
    problem_ = "the inverse of T_cam_imu was given: its rotation fits the images the other way";
    cam_from_imu_ = cam_from_imu_.Inverse();
    true_axes_.setIdentity();
  } else if (found.determinant() < 0) {
    problem_ =
        "the IMU's axes are left-handed: two of them are swapped, or one has the wrong sign; the "
        "turns of the images tell the true ones";
    true_axes_ = *better * true_axes_;
  } else {
    problem_ = fmt::format(
        "the IMU's axes are turned by {:.0f} deg against those given (T_cam_imu), as the turns of "
        "the images tell",
        turn / kDegree);
    true_axes_ = *better * true_axes_;
  }
  gyroscope_ = Gyroscope();
  ForgetSamples(window);
}

void InertialSensor::ForgetSamples(Window& window) {
  accelerometer_ = Accelerometer();
  window.inertial.reset();
  for (WindowImage& image : window.images) {
    image.push.reset();
    image.told.reset();
  }
  held_triples_.clear();
  contradictions_ = 0;
}

void InertialSensor::LearnFromHeld(const WindowImage& image, const WindowOptions& options,
                                   Window& window) {
  if (window.inertial) {
    // As it was when the image came, when the poses were free.
    if (image.told) window.inertial->prior = *image.told;
    return;
  }
  const size_t at = window.IndexOf(image.id);
  if (at < 2) return;
  const auto triple = TripleOf(window, at);
  if (!triple) return;
  held_triples_.push_back(Known(*triple, PosesBefore(window, at), cam_from_imu_.translation,
                                CenterSigma(options, window)));
  if (held_triples_.size() > kMostTriples) held_triples_.erase(held_triples_.begin());
}

// What the images up to this keyframe tell of the inertial unknowns, later: the unit of the images
// drifts, and the bias and the vertical wander.
void InertialSensor::KeepWhatIsTold(Window& window) {
  // In a second, each along an axis.
  constexpr double kUnit = 0.005, kBias = 0.01, kTilt = 0.01;
  const double seconds = window.newest().time_s - std::exchange(told_s_, window.newest().time_s);
  if (!(covariance_(0, 0) > 0)) return;
  InertialMatrix covariance = covariance_;
  covariance(0, 0) += std::pow(kUnit * window.inertial->value[0], 2) * seconds;
  covariance.diagonal().segment<3>(1).array() += kTilt * kTilt * seconds;
  covariance.diagonal().tail<3>().array() += kBias * kBias * seconds;
  auto told = std::make_shared<InertialPrior>();
  told->information = InverseOf<7>(covariance);
  told->right = told->information * window.inertial->value;
  window.newest().told = std::move(told);
}

// How the images of the window that are not held and the accelerations agree.
std::optional<InertialFit> InertialSensor::FitOfWindow(const WindowOptions& options,
                                                       const Window& window) const {
  Window keyframes;  // without points
  keyframes.images = window.images;
  for (const WindowImage& image : window.images)
    if (!image.is_keyframe) keyframes.Remove(image.id);
  std::vector<KnownTriple> triples = held_triples_;
  for (size_t i = 2; i < keyframes.images.size(); ++i)
    if (const auto triple = TripleOf(keyframes, i); triple && !keyframes.images[i].is_held)
      triples.push_back(Known(*triple, PosesBefore(keyframes, i), cam_from_imu_.translation,
                              CenterSigma(options, window)));
  return FitInertial(triples, acceleration_noise_);
}

void InertialSensor::Align(const WindowOptions& options, Window& window) {
  constexpr double kStep = 0.03, kLeastNoise = 0.003, kMostNoise = 0.1;
  constexpr double kMostSigma = 0.1, kMostChi2 = 4;
  if (accelerometer_.IsEmpty()) return;
  if (!window.inertial) {
    const auto fit = FitOfWindow(options, window);
    if (!fit || fit->sigma_unit > kMostSigma) return;
    if (fit->chi2 > kMostChi2 || fit->value[0] < 0) {
      if (++contradictions_ < kOften) return;
      held_triples_.clear();
      if (fit->chi2 > kMostChi2) return;
      problem_ =
          "the accelerations have the wrong sign: at rest they point to the ground (an IMU "
          "measures the force that holds it); taken the other way round";
      is_sign_wrong_ = !is_sign_wrong_;
      ForgetSamples(window);
      return;
    }
    BeginAligned(*fit, window);
    return;
  }
  acceleration_noise_ =
      std::clamp(window.inertial->noise * std::exp(InertialMisfit(window) > 1 ? kStep : -kStep),
                 kLeastNoise, kMostNoise);
  window.inertial->noise = acceleration_noise_;
  KeepWhatIsTold(window);
  if (acceleration_noise_ < kMostNoise) return;
  ForgetSamples(window);
  contradictions_ = kOften;
  acceleration_noise_ = kUsualAccelerationNoise;
}

void InertialSensor::BeginAligned(const InertialFit& fit, Window& window) {
  contradictions_ = 0;
  window.inertial =
      WindowInertial{fit.value, PriorBy(held_triples_, acceleration_noise_, fit.value),
                     cam_from_imu_.translation, acceleration_noise_};
  held_triples_.clear();
  unit_sigma_ = fit.sigma_unit;
  covariance_.setZero();
  told_s_ = window.newest().time_s;
}

void InertialSensor::SetCovariance(const InertialMatrix& covariance, Window& window) {
  covariance_ = covariance;
  unit_sigma_ = std::sqrt(covariance(0, 0)) / window.inertial->value[0];
  // A unit of no or negative length is no solution.
  if (!(window.inertial->value[0] > 0 && covariance(0, 0) > 0)) ForgetSamples(window);
}

std::optional<Eigen::Vector3d> CenterByInertia(const Window& window,
                                               const Rigid3::Rotation& rotation) {
  const size_t newest = window.images.size() - 1;
  if (!window.inertial || newest < 2) return std::nullopt;
  const auto triple = TripleOf(window, newest);
  if (!triple) return std::nullopt;
  std::array<Rigid3, 3> poses = PosesBefore(window, newest);
  poses[2] = Rigid3(rotation, Eigen::Vector3d::Zero());
  const InertialResidual residual =
      ResidualOf(*triple, poses, window.inertial->lever, window.inertial->value);
  return -residual.value / residual.by_center[2];
}

bool InertialSensor::CanCarry(const Window& window, double seen_s) const {
  constexpr double kMostSeconds = 2, kMostSigma = 0.05;
  return window.inertial && window.newest().push && unit_sigma_ < kMostSigma &&
         window.newest().time_s - seen_s < kMostSeconds;
}

ImuCalibration InertialSensor::Calibration(const Window& window) const {
  ImuCalibration known;
  known.gyroscope = gyroscope_.calibration();
  known.problem = problem_;
  if (contradictions_ >= kOften) {
    known.accelerometer = AccelerometerState::kRefused;
    if (!known.problem.empty()) known.problem += "; ";
    known.problem +=
        "the accelerations contradict the motion of the images: their unit (m/s^2), their axes, "
        "their sign or their clock is wrong, or the video was stabilised; they are not used";
  }
  if (window.inertial) {
    known.accelerometer = AccelerometerState::kCalibrated;
    known.acceleration_bias = window.inertial->value.tail<3>();
    known.sigma_acceleration_bias = std::sqrt(covariance_.diagonal().tail<3>().maxCoeff());
    known.sigma_metre = metre_sigma();
  }
  return known;
}

}  // namespace oaslam
