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

  // At the time of an image: of a fast sensor what its samples within 0.1 s of it agree on (a line
  // fitted to them), for a hand trembles; of a slow one between the samples before and after where
  // these are at most three sample intervals (the median of all) apart, else the nearest if that is
  // at most one and a half away. Nothing where there is none.
  std::optional<Eigen::Vector3d> At(double timestamp);

  // Where there were samples and images, but no sample near any image: says so, with the times of
  // both.
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
