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

  // The sample nearest in time, within 20 ms.
  std::optional<Eigen::Vector3d> At(double timestamp) const;

 private:
  struct Sample {
    double timestamp = 0;
    Eigen::Vector3d in_cam = Eigen::Vector3d::Zero();
  };
  std::vector<Sample> samples_;  // ascending in time
};

}  // namespace oaslam::apps
