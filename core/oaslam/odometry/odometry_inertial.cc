// What an IMU tells the odometry.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <memory>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/odometry/odometry.h"
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

// Whether a small image shows more than darkness or fog, where corners would be noise.
bool HasContrast(const GreyImage& small) {
  constexpr double kLeast = 3;  // grey levels, standard deviation
  double sum = 0, squared = 0;
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x) {
      const double grey = small.Row(y)[x];
      sum += grey;
      squared += grey * grey;
    }
  const double count = static_cast<double>(small.width) * small.height, mean = sum / count;
  return squared / count - mean * mean > kLeast * kLeast;
}

}  // namespace

void Odometry::SetImu(const Rigid3& cam_from_imu) {
  cam_from_imu_ = cam_from_imu;
  true_axes_.setIdentity();
  is_sign_wrong_ = false;
  imu_problem_.clear();
  gyroscope_ = Gyroscope();
  BeginImuAnew();
  if (!window_.images.empty()) BeginAnew();
}

void Odometry::AddSamples(const OdometrySensors& sensors) {
  CorrectAxes();
  std::vector<AngularVelocity> rates(sensors.angular_velocity.begin(),
                                     sensors.angular_velocity.end());
  for (AngularVelocity& rate : rates) rate.in_cam = true_axes_ * rate.in_cam;
  std::vector<ImuSample> samples(sensors.imu.begin(), sensors.imu.end());
  const Eigen::Matrix3d axes = true_axes_ * cam_from_imu_.rotation.toRotationMatrix();
  for (ImuSample& sample : samples) {
    sample.angular_velocity = axes * sample.angular_velocity;
    sample.acceleration = (is_sign_wrong_ ? -1 : 1) * (axes * sample.acceleration);
    rates.push_back({sample.timestamp, sample.angular_velocity});
  }
  gyroscope_.Add(rates);
  accelerometer_.Add(samples);
}

// A wrong T_cam_imu, or axes of a recorder that are named otherwise, show in the turns.
void Odometry::CorrectAxes() {
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
    imu_problem_ = "the inverse of T_cam_imu was given: its rotation fits the images the other way";
    cam_from_imu_ = cam_from_imu_.Inverse();
    true_axes_.setIdentity();
  } else if (found.determinant() < 0) {
    imu_problem_ =
        "the IMU's axes are left-handed: two of them are swapped, or one has the wrong sign; the "
        "turns of the images tell the true ones";
    true_axes_ = *better * true_axes_;
  } else {
    imu_problem_ = fmt::format(
        "the IMU's axes are turned by {:.0f} deg against those given (T_cam_imu), as the turns of "
        "the images tell",
        turn / kDegree);
    true_axes_ = *better * true_axes_;
  }
  gyroscope_ = Gyroscope();
  BeginImuAnew();
}

void Odometry::BeginImuAnew() {
  accelerometer_ = Accelerometer();
  window_.inertial.reset();
  for (WindowImage& image : window_.images) {
    image.push.reset();
    image.told.reset();
  }
  held_triples_.clear();
  inertial_contradictions_ = 0;
}

// The standard deviation of the place of a camera beside its neighbours, units.
double Odometry::CenterSigma() const {
  constexpr double kPx = 0.15;  // at the median depth
  return kPx / window_options_.focal_px / window_.median_inverse_depth;
}

// From now on the pose of the image is no longer changed. What it and the images before it tell of
// the inertial unknowns is known by then: as it was when the image came, when their poses were
// free.
void Odometry::Hold(WindowImage& image) {
  image.is_held = true;
  if (window_.inertial) {
    if (!image.told) return;
    window_.inertial->prior = *image.told;
    return;
  }
  const size_t at = window_.IndexOf(image.id);
  if (at < 2) return;
  const auto triple = TripleOf(window_, at);
  if (!triple) return;
  held_triples_.push_back(
      Known(*triple, PosesBefore(window_, at), cam_from_imu_.translation, CenterSigma()));
  if (held_triples_.size() > kMostTriples) held_triples_.erase(held_triples_.begin());
}

// How much the accelerometer's changes of velocity differ from those of the images, in sigmas: the
// median, of an axis.
double Odometry::InertialMisfit() const {
  std::vector<double> squared;
  const WindowInertial& inertial = *window_.inertial;
  for (size_t i = 2; i < window_.images.size(); ++i) {
    auto triple = window_.images[i].is_held ? std::nullopt : TripleOf(window_, i);
    if (!triple) continue;
    triple->sigma = inertial.noise * std::sqrt(triple->seconds());
    squared.push_back(ResidualOf(*triple, PosesBefore(window_, i), inertial.lever, inertial.value)
                          .value.squaredNorm());
  }
  constexpr double kMedian = 2.366;  // of the squared length of three Gaussians
  return squared.empty() ? 1 : std::sqrt(Median(std::move(squared)) / kMedian);
}

// What the images up to this keyframe tell of the inertial unknowns, later: the unit of the images
// drifts, and the bias and the vertical wander.
void Odometry::TellInertial() {
  // In a second, each along an axis.
  constexpr double kUnit = 0.005, kBias = 0.01, kTilt = 0.01;
  const double seconds = window_.newest().time_s - std::exchange(told_s_, window_.newest().time_s);
  if (!(told_(0, 0) > 0)) return;
  InertialMatrix covariance = told_;
  covariance(0, 0) += std::pow(kUnit * window_.inertial->value[0], 2) * seconds;
  covariance.diagonal().segment<3>(1).array() += kTilt * kTilt * seconds;
  covariance.diagonal().tail<3>().array() += kBias * kBias * seconds;
  auto told = std::make_shared<InertialPrior>();
  told->information = InverseOf<7>(covariance);
  told->right = told->information * window_.inertial->value;
  window_.newest().told = std::move(told);
}

// How the images of the window that are not held and the accelerations agree.
std::optional<InertialFit> Odometry::FitOfWindow() const {
  Window keyframes;  // without points
  keyframes.images = window_.images;
  for (const WindowImage& image : window_.images)
    if (!image.is_keyframe) keyframes.Remove(image.id);
  std::vector<KnownTriple> triples = held_triples_;
  for (size_t i = 2; i < keyframes.images.size(); ++i)
    if (const auto triple = TripleOf(keyframes, i); triple && !keyframes.images[i].is_held)
      triples.push_back(
          Known(*triple, PosesBefore(keyframes, i), cam_from_imu_.translation, CenterSigma()));
  return FitInertial(triples, acceleration_noise_);
}

// Looks whether the motion so far determines the length of its unit; or, where it is known, keeps
// what the images tell. Where the accelerations contradict the images, they are not used.
void Odometry::AlignInertial() {
  constexpr double kStep = 0.03, kLeastNoise = 0.003, kMostNoise = 0.1;
  constexpr double kMostSigma = 0.1, kMostChi2 = 4;
  if (accelerometer_.IsEmpty()) return;
  if (!window_.inertial) {
    const auto fit = FitOfWindow();
    if (!fit || fit->sigma_unit > kMostSigma) return;
    if (fit->chi2 > kMostChi2 || fit->value[0] < 0) {
      if (++inertial_contradictions_ < kOften) return;
      held_triples_.clear();
      if (fit->chi2 > kMostChi2) return;
      imu_problem_ =
          "the accelerations have the wrong sign: at rest they point to the ground (an IMU "
          "measures the force that holds it); taken the other way round";
      is_sign_wrong_ = !is_sign_wrong_;
      BeginImuAnew();
      return;
    }
    inertial_contradictions_ = 0;
    window_.inertial =
        WindowInertial{fit->value, PriorBy(held_triples_, acceleration_noise_, fit->value),
                       cam_from_imu_.translation, acceleration_noise_};
    held_triples_.clear();
    metre_sigma_ = fit->sigma_unit;
    told_.setZero();
    told_s_ = window_.newest().time_s;
    return;
  }
  acceleration_noise_ =
      std::clamp(window_.inertial->noise * std::exp(InertialMisfit() > 1 ? kStep : -kStep),
                 kLeastNoise, kMostNoise);
  window_.inertial->noise = acceleration_noise_;
  TellInertial();
  if (acceleration_noise_ < kMostNoise) return;
  BeginImuAnew();
  inertial_contradictions_ = kOften;
  acceleration_noise_ = kUsualAccelerationNoise;
}

// The centre of the newest image's camera, which has this rotation, as the velocity before it and
// the accelerations tell it; nothing where they do not.
std::optional<Eigen::Vector3d> Odometry::CenterByInertia(const Rigid3::Rotation& rotation) const {
  const size_t newest = window_.images.size() - 1;
  if (!window_.inertial || newest < 2) return std::nullopt;
  const auto triple = TripleOf(window_, newest);
  if (!triple) return std::nullopt;
  std::array<Rigid3, 3> poses = PosesBefore(window_, newest);
  poses[2] = Rigid3(rotation, Eigen::Vector3d::Zero());
  const InertialResidual residual =
      ResidualOf(*triple, poses, window_.inertial->lever, window_.inertial->value);
  return -residual.value / residual.by_center[2];
}

// What is seen in darkness, noise of the image and of its compression, does not move with the
// scene.
bool Odometry::ContradictsGyroscope(const Rigid3& pose, const PoseFitPrior& prior) const {
  constexpr double kSurelyOff = 8, kMost = 0.5 * kDegree;
  if (!window_.inertial || !prior.rotation) return false;
  const double off = pose.rotation.angularDistance(prior.rotation->second_from_first);
  return off > std::max(kMost, kSurelyOff * std::sqrt(prior.rotation->variance));
}

// The IMU carries the camera over images that show nothing, as long as it knows the way to some
// hundredths.
bool Odometry::CanFollowInertia() const {
  constexpr double kMostSeconds = 2, kMostSigma = 0.05;
  return !is_beginning_ && window_.inertial && window_.newest().push && metre_sigma_ < kMostSigma &&
         window_.newest().time_s - seen_s_ < kMostSeconds;
}

// The newest image shows too little; its pose is the predicted one. What it shows is followed from
// here on.
void Odometry::FollowInertia(const Rigid3& predicted, OdometryEstimate& estimate) {
  if (!CanFollowInertia()) {
    estimate.state = OdometryState::kBlind;
    return;
  }
  estimate.state = OdometryState::kInertial;
  WindowImage& newest = window_.newest();
  newest.cam_from_odom = predicted;
  newest.median_inverse_depth = window_.median_inverse_depth;
  estimate.cam_from_odom = predicted;
  estimate.covariance = covariance_;
  estimate.inliers = 0;
  for (WindowPoint& p : window_.points) {
    if (!p.sightings.empty() && p.sightings.back().image == newest.id) p.sightings.pop_back();
    p.is_tracked = false;
  }
  is_sure_ = false;
  estimate.is_keyframe = HasContrast(present_->level(present_->levels() - 1));
  if (estimate.is_keyframe) MakeKeyframe();
}

ImuCalibration Odometry::imu() const {
  ImuCalibration known;
  known.gyroscope = gyroscope_.calibration();
  known.problem = imu_problem_;
  if (inertial_contradictions_ >= kOften) {
    known.accelerometer = AccelerometerState::kRefused;
    if (!known.problem.empty()) known.problem += "; ";
    known.problem +=
        "the accelerations contradict the motion of the images: their unit (m/s^2), their axes, "
        "their sign or their clock is wrong, or the video was stabilised; they are not used";
  }
  if (window_.inertial) {
    known.accelerometer = AccelerometerState::kCalibrated;
    known.acceleration_bias = window_.inertial->value.tail<3>();
    known.sigma_acceleration_bias = std::sqrt(told_.diagonal().tail<3>().maxCoeff());
    known.sigma_metre = kOfMetreSigma * metre_sigma_;
  }
  return known;
}

}  // namespace oaslam
