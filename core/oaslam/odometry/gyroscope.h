#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/angular_velocity.h"
#include "oaslam/odometry/turn.h"

namespace oaslam {

// A gyroscope beside a camera. Its bias and its time offset are estimated so that its samples
// explain the rotations between the images of the last half minute best.
class Gyroscope {
 public:
  static constexpr double kMostOffset = 0.25;  // s: the offset is looked for up to here

  Gyroscope();

  // Samples that are not newer than the ones before are ignored.
  void Add(std::span<const AngularVelocity> samples);

  // The integral of the samples between the times of two images. Nothing where samples are missing
  // for more than 0.1 s, and while the gyroscope is refused.
  std::optional<Turn> Between(double first_s, double second_s) const;

  // Calibrates the gyroscope by a rotation that was estimated from images, once all samples around
  // the two images have arrived.
  void Compare(double first_s, double second_s, const Eigen::Quaterniond& second_from_first);

  // Axes by which the images and the samples agree, where they do not by the axes that were given:
  // an orthogonal matrix by which the samples are to be multiplied. Nothing where the axes are
  // right, where the camera has not turned about two axes yet, and where no axes make them agree.
  std::optional<Eigen::Matrix3d> BetterAxes() const;

  GyroscopeState state() const;
  // The last calibration that the images did not contradict, with the present state.
  GyroscopeCalibration calibration() const;

 private:
  struct Orientation {
    Eigen::Quaterniond start_from_camera;  // integrated without removing the bias
    int segment = 0;                       // a new one begins after each gap between the samples
  };
  struct Sample {
    double time_s = 0;
    Eigen::Vector3d rate;  // rad/s
    Orientation orientation;
  };
  struct Comparison {
    double first_s = 0, second_s = 0;
    Eigen::Quaterniond first_from_second;
  };
  // Weighted sums over comparisons, the older with less weight, for one candidate for the offset.
  // The error of a comparison is the rotation by the samples minus the rotation by the images.
  struct Errors {
    Eigen::Vector3d by_duration = Eigen::Vector3d::Zero();
    double squared = 0;
    // Of the rotations about their means: by the images times by the samples, and by the samples.
    Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
    double of_samples = 0;
  };

  // Nothing where samples are missing.
  std::optional<Orientation> OrientationAt(double time_s) const;
  // first_from_second between two times of the gyroscope's clock, with the bias in it; nothing
  // where samples are missing.
  std::optional<Eigen::Quaterniond> Integral(double first_s, double second_s) const;
  // As Between, but also while the gyroscope is refused.
  std::optional<Turn> Calibrated(double first_s, double second_s) const;
  Eigen::Vector3d RateAt(double time_s) const;
  void Learn(const Comparison& comparison);
  // The calibration by all comparisons; nothing where they do not fit any.
  std::optional<GyroscopeCalibration> BestCalibration() const;
  void Calibrate();

  std::deque<Sample> samples_;
  std::deque<Comparison> waiting_;
  std::vector<Errors> errors_;  // by candidate
  // The number of comparisons, the older with less weight; and the same, weighted by how well they
  // fit.
  double compared_ = 0, agreed_ = 0;
  double squared_duration_ = 0;
  double of_images_ = 0;  // the sum of their squared rotations
  GyroscopeCalibration calibration_;
  bool is_trusted_ = true;
};

}  // namespace oaslam
