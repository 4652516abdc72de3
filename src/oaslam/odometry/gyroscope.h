#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/angular_velocity.h"
#include "oaslam/odometry/turn.h"

namespace oaslam {

// What is true of a gyroscope beside its samples. A sample with the time stamp t + offset_s belongs
// to an image with the time stamp t. Before the images tell anything, the sigmas are those of what
// a phone may have.
struct GyroscopeCalibration {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // rad/s, to be subtracted
  double sigma_bias = 0;                           // rad/s, of each axis
  double offset_s = 0, sigma_offset_s = 0;
  double sigma = 0;  // rad, of each axis: what images and samples differ by from image to image
};

// A gyroscope beside a camera. Its bias and its time offset are those with which it explains best
// how the images turned in the last half minute.
class Gyroscope {
 public:
  Gyroscope();

  // Samples that are not newer than the ones before are ignored.
  void Add(std::span<const AngularVelocity> samples);

  // The integral of the samples between the times of two images. Nothing where there is no
  // calibration or samples are missing.
  std::optional<Turn> Between(double first_s, double second_s) const;

  // Learns from a rotation that the images tell. It is looked at once all samples about it are
  // there.
  void Compare(double first_s, double second_s, const Eigen::Quaterniond& second_from_first);

  // Nothing while most images contradict the samples: their axes or their unit may be wrong.
  const std::optional<GyroscopeCalibration>& calibration() const { return calibration_; }
  bool has_samples() const { return !samples_.empty(); }

 private:
  struct Sample {
    double time_s = 0;
    Eigen::Vector3d rate;                  // rad/s
    Eigen::Quaterniond start_from_camera;  // integrated with the bias in it
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

  // The integral from the first sample on, the bias in it; nothing where samples are missing.
  std::optional<Eigen::Quaterniond> OrientationAt(double time_s) const;
  Eigen::Vector3d RateAt(double time_s) const;
  void Learn(const Comparison& comparison);
  void Calibrate();

  std::deque<Sample> samples_;
  std::deque<Comparison> waiting_;
  std::vector<Errors> errors_;  // by candidate
  // Of comparisons, the older the less; and the same by how well they fit.
  double compared_ = 0, agreed_ = 0;
  double squared_duration_ = 0;
  std::optional<GyroscopeCalibration> calibration_;
};

}  // namespace oaslam
