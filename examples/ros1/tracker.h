// What the node needs of OA-SLAM, without its headers: those of ROS 1 are no C++20.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

struct TrackerOptions {
  std::string mode, detector, map_in;  // as the parameters of the node
};

// A calibration in the words of sensor_msgs/CameraInfo.
struct CameraInfo {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::string distortion_model;
  std::vector<double> distortion;
};

struct Pose {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d position;
};

struct Tracked {
  std::string state;
  std::optional<Pose> world_from_cam;  // the camera's optical frame in the map
};

struct Thing {
  uint32_t id = 0;
  std::string name;
  Pose world_from_thing;
  Eigen::Vector3d size;  // of its ellipsoid, along its axes
};

// Slam with a detector beside it. What cannot be used throws std::runtime_error.
class Tracker {
 public:
  Tracker(const TrackerOptions& options, const CameraInfo& camera);
  ~Tracker();
  Tracked Track(const cv::Mat& image, double timestamp);
  std::vector<Thing> Things() const;
  void Save(const std::string& path);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};
