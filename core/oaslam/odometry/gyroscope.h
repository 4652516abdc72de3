#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/angular_velocity.h"
#include "oaslam/odometry/turn.h"

namespace oaslam {

// A gyroscope beside a camera. Its bias and its time offset are those with which it explains best
// how the images turned in the last half minute.
class Gyroscope {
 public:
  static constexpr double kMostOffset = 0.25;  // s: the offset is looked for up to here

  Gyroscope();

  // Samples that are not newer than the ones before are ignored.
  void Add(std::span<const AngularVelocity> samples);

  // The integral of the samples between the times of two images. Nothing where samples are missing
  // for more than 0.1 s, and while the gyroscope is refused.
  std::optional<Turn> Between(double first_s, double second_s) const;

  // Learns from a rotation that the images tell. It is looked at once all samples about it are
  // there.
  void Compare(double first_s, double second_s, const Eigen::Quaterniond& second_from_first);

  GyroscopeState state() const;
  // The last calibration that the images did not contradict, with the present state.
  GyroscopeCalibration calibration() const;

 private:
  struct Orientation {
    Eigen::Quaterniond start_from_camera;  // integrated with the bias in it
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
  // Sums over comparisons, the older the less, of the error of the samples' rotation with one
  // candidate for the offset: rotation by the samples less rotation by the images.
  struct Errors {
    Eigen::Vector3d by_duration = Eigen::Vector3d::Zero();
    double squared = 0;
  };

  // Nothing where samples are missing.
  std::optional<Orientation> OrientationAt(double time_s) const;
  // first_from_second between two times of the gyroscope's clock, the bias in it; nothing where
  // samples are missing.
  std::optional<Eigen::Quaterniond> Integral(double first_s, double second_s) const;
  // Between, whether the gyroscope is refused or not.
  std::optional<Turn> Calibrated(double first_s, double second_s) const;
  Eigen::Vector3d RateAt(double time_s) const;
  void Learn(const Comparison& comparison);
  // The calibration by all comparisons; nothing where they do not fit any.
  std::optional<GyroscopeCalibration> BestCalibration() const;
  void Calibrate();

  std::deque<Sample> samples_;
  std::deque<Comparison> waiting_;
  std::vector<Errors> errors_;  // by candidate
  // Of comparisons, the older the less; and the same by how well they fit.
  double compared_ = 0, agreed_ = 0;
  double squared_duration_ = 0;
  GyroscopeCalibration calibration_;
  bool is_trusted_ = true;
};

}  // namespace oaslam
