#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

// What the node asks of OA-SLAM. This header compiles as C++17, for ROS, and as C++20, for
// oaslam's. Errors are std::runtime_error.

struct Settings {
  std::string config, detector, map;  // paths; empty: none
  bool mapping = true;
};

struct Lens {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  bool is_equidistant = false;     // else plumb_bob
  std::vector<double> distortion;  // at most 4 or 5
};

struct Answer {
  std::string problem;  // why the image was refused, or empty
  std::string state;
  // The camera with optical axes in a frame with z up, where it was found.
  std::optional<Eigen::Isometry3d> map_from_cam;
  bool is_another_map = false;  // that frame is another one than for the last image
};

struct MappedObject {
  int id = 0;
  std::string name;
  Eigen::Isometry3d map_from_object;  // of the axes of its ellipsoid
  Eigen::Vector3d half_axes;
};

class Tracker {
 public:
  Tracker(const Settings& settings, const Lens& lens);
  ~Tracker();
  // The image may be a view; it is not kept.
  Answer Track(const cv::Mat& image, double timestamp);
  // All objects of the map, if it has changed since the last call.
  std::optional<std::vector<MappedObject>> ObjectsIfNew();
  bool IsMetric() const;
  void Save(const std::string& path);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};
