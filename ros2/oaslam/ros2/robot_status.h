#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/exports/result_messages.h"
#include "oaslam/ros2/dds_node.h"

namespace oaslam {

// What a node knows of itself, for `status` and for people.
struct RobotStatus {
  std::string image_topic;  // as asked for, or the one that is read
  int publishers = 0;       // of it
  std::vector<Publication> publications{};
  int images = 0, missed = 0, without_stamp = 0, out_of_order = 0, unreadable = 0, clock_jumps = 0;
  int recent_images = 0, recent_infos = 0;  // messages of both topics in a stretch of seconds
  std::optional<double> silence_s{};        // since the last image; nothing: none has come
  std::string state = "no image yet";       // of tracking
  bool has_result = false, has_pose = false, is_metric = false, is_mapping = true;
  std::string map = "map", odom = "odom", base = "base_link", camera{};  // frames
  // What /tf knows: nothing, the frames, or their transform at the time of the images.
  enum class Known { kNot, kAtOtherTimes, kNow };
  Known base_from_camera = Known::kNot, odom_from_base = Known::kNot;
  std::string imu_problem{};     // ImuCalibration::problem
  bool has_optical_axes = true;  // the frame of the images, unless they are those of `base`
  bool wants_camera_tf = false, camera_has_parent = false;
};

// What is wrong, a sentence each, the most important first.
std::vector<std::string> ProblemsOf(const RobotStatus& status);

Diagnostic DiagnosticOf(const RobotStatus& status);

}  // namespace oaslam
