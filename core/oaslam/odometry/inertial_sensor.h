#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "oaslam/angular_velocity.h"
#include "oaslam/imu.h"
#include "oaslam/odometry/accelerometer.h"
#include "oaslam/odometry/gyroscope.h"
#include "oaslam/odometry/inertial.h"
#include "oaslam/odometry/window.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// The IMU, or the gyroscope alone, beside the odometry's camera: its samples, and what the images
// have told of it. `window` is the odometry's in all functions. It holds what the samples measured
// between its images, and the inertial unknowns, once the images have told the metre.
class InertialSensor {
 public:
  // An IMU whose pose relative to the camera is this one (metres). Forgets what was learned of the
  // one before.
  void Replace(const Rigid3& cam_from_imu, Window& window);
  // `rates` along the camera's axes, `samples` along those of the IMU.
  void Add(std::span<const AngularVelocity> rates, std::span<const ImuSample> samples,
           Window& window);
  // Sets the turn and the push of an image, which are from `since_s` on.
  void Measure(double since_s, WindowImage& image) const;
  // Calibrates the gyroscope by two images whose poses are sure.
  void Calibrate(const WindowImage& first, const WindowImage& second);
  // After a change of the odometry's frame and unit.
  void BeginRun() { held_triples_.clear(); }

  // An image of the window has become held: its pose is no longer changed. Keeps what it and the
  // images before it tell of the inertial unknowns.
  void LearnFromHeld(const WindowImage& image, const WindowOptions& options, Window& window);
  // At a new keyframe: looks whether the motion so far determines the length of its unit; or, where
  // it is known, keeps what the images tell. Where the accelerations contradict the images, they
  // are not used.
  void Align(const WindowOptions& options, Window& window);
  // After an optimisation of the window: the covariance of the inertial unknowns.
  void SetCovariance(const InertialMatrix& covariance, Window& window);

  // Whether the IMU still knows the camera's way to some hundredths, where no image since `seen_s`
  // has told the pose.
  bool CanCarry(const Window& window, double seen_s) const;
  const Gyroscope& gyroscope() const { return gyroscope_; }
  // The standard deviation of the length of a metre, divided by it; only with the window's inertial
  // unknowns.
  double metre_sigma() const { return kOfMetreSigma * unit_sigma_; }
  ImuCalibration Calibration(const Window& window) const;

 private:
  void CorrectAxes(Window& window);
  void ForgetSamples(Window& window);
  std::optional<InertialFit> FitOfWindow(const WindowOptions& options, const Window& window) const;
  void BeginAligned(const InertialFit& fit, Window& window);
  void KeepWhatIsTold(Window& window);

  Gyroscope gyroscope_;
  Accelerometer accelerometer_;
  Rigid3 cam_from_imu_;
  // By which samples along the axes that were given are multiplied: the images have shown that the
  // axes are others.
  Eigen::Matrix3d true_axes_ = Eigen::Matrix3d::Identity();
  bool is_sign_wrong_ = false;  // of the accelerations
  std::string problem_;
  int contradictions_ = 0;                               // of keyframes in a row
  double acceleration_noise_ = kUsualAccelerationNoise;  // learned
  std::vector<KnownTriple> held_triples_;  // of this run, until the inertial unknowns are known
  // Of the last optimisation: the covariance of the inertial unknowns, and the standard deviation
  // of the length of the unit, divided by it.
  InertialMatrix covariance_ = InertialMatrix::Zero();
  double unit_sigma_ = 0;
  double told_s_ = 0;  // when a keyframe last kept what is known
};

// The centre of the newest image's camera, which has this rotation, as the velocity before it and
// the accelerations tell it; nothing where they do not.
std::optional<Eigen::Vector3d> CenterByInertia(const Window& window,
                                               const Rigid3::Rotation& rotation);

}  // namespace oaslam
