#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/class_names.h"
#include "oaslam/exports/ros_map_frame.h"
#include "oaslam/map/map.h"
#include "oaslam/recordings/mcap_writer.h"
#include "oaslam/rigid3.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/types.h"

namespace oaslam {

// The frame of a camera, with the axes of OpenCV.
inline constexpr char kCameraFrame[] = "camera_optical_frame";

// Results as messages of ROS 2 in an MCAP file (docs/robots.md). Positions and poses are given in
// the world of the map, and written in the frame `map`. Times are seconds. Functions throw as
// McapWriter does.
class ResultTopics {
 public:
  // As of McapWriter.
  explicit ResultTopics(const std::string& path, const std::string& name = "");

  // The pose of the world in the frame `map`, from now on.
  void SetMapFromWorld(const Rigid3& map_from_world) { map_from_world_ = map_from_world; }

  // `frame`: of the camera.
  void AddTransform(double time, const std::string& frame, const Rigid3& world_from_cam);
  void AddPose(double time, const Rigid3& world_from_cam, const PoseCovariance& covariance);
  // `topic`: a number of AddPathTopic.
  void AddPath(double time, uint16_t topic, const std::vector<StampedPose>& poses);
  uint16_t AddPathTopic(const std::string& name) { return file_.AddTopic(name, "nav_msgs/Path"); }
  // Landmarks and objects.
  void AddMap(double time, const Map& map, const ClassNames& names);
  // A picture without distortion, with its camera.
  void AddPicture(double time, const cv::Mat& picture, const Camera& camera);
  // In the pixels of the picture.
  void AddDetections(double time, const std::vector<Detection>& detections,
                     const ClassNames& names);
  // A sentence for people.
  void AddEvent(double time, bool is_warning, const std::string& text);
  void Finish() { file_.Finish(); }

 private:
  McapWriter file_;
  uint16_t transforms_, pose_, landmarks_, markers_, objects_, image_, camera_, detections_,
      events_;
  Rigid3 map_from_world_;
};

}  // namespace oaslam
