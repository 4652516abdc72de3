#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace oaslam::apps {

// The direction of gravity in the camera's frame over time, as a phone's sensors give it.
class GravityTrack {
 public:
  GravityTrack() = default;
  // "timestamp gx gy gz" a line, any length. Throws InputError.
  static GravityTrack Load(const std::string& path);

  // Gravity at the time of an image. Of a fast sensor, a line is fitted to the samples within 0.1
  // s, since a hand trembles. Of a slow one, the samples before and after are interpolated if they
  // are at most three sample intervals (the median of all) apart; else the nearest one is used if
  // it is at most one and a half intervals away. Nothing where there is none.
  std::optional<Eigen::Vector3d> At(double timestamp);

  bool empty() const { return samples_.empty(); }

  // Warns, with the times of both, where there were samples and images but no
  // sample near any image.
  void WarnIfUnused() const;

 private:
  struct Sample {
    double timestamp = 0;
    Eigen::Vector3d in_cam = Eigen::Vector3d::Zero();
  };
  std::optional<Eigen::Vector3d> Smoothed(double timestamp) const;

  std::string path_;
  std::vector<Sample> samples_;  // ascending in time
  double interval_ = 0;          // seconds between two samples
  std::optional<double> first_asked_, last_asked_;
  bool is_used_ = false;
};

}  // namespace oaslam::apps
