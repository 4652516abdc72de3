#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/recordings/cdr_writer.h"
#include "oaslam/rigid3.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/types.h"

namespace oaslam {

// Results as messages of ROS 2 in CDR, for recordings (ResultTopics) and for live topics (ros2/).
// Positions of a map are given in its world, and written in a frame that `map_from_world` leads to.

// Nanoseconds; what a stamp of ROS cannot tell becomes the nearest that it can.
int64_t NanosecondsOf(double seconds);

// std_msgs/Header.
struct MessageHeader {
  int64_t stamp = 0;  // nanoseconds
  std::string frame{};
};

// Row by row, as ROS has them: position, then rotation about the fixed axes.
using RosCovariance = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
// ROS has both parts of the covariance in the axes of the map, OA-SLAM in those of the camera.
RosCovariance InAxesOf(const Rigid3& map_from_cam, const PoseCovariance& covariance);

// geometry_msgs/TwistWithCovariance: m/s and rad/s, all in the axes of the frame that moves.
struct RosTwist {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();
  RosCovariance covariance = RosCovariance::Zero();
};

// diagnostic_msgs/DiagnosticStatus.
struct Diagnostic {
  enum Level : uint8_t { kOk = 0, kWarning = 1, kError = 2 };
  Level level = kOk;
  std::string name{}, message{};
  std::vector<std::pair<std::string, std::string>> values{};
};

// tf2_msgs/TFMessage of one transform.
CdrWriter TransformMessage(const MessageHeader& header, const std::string& child,
                           const Rigid3& pose);
// geometry_msgs/PoseWithCovarianceStamped.
CdrWriter PoseMessage(const MessageHeader& header, const Rigid3& pose,
                      const RosCovariance& covariance);
// nav_msgs/Odometry. `pose`: of the frame `child`.
CdrWriter OdometryMessage(const MessageHeader& header, const std::string& child, const Rigid3& pose,
                          const RosCovariance& covariance, const RosTwist& twist);
// nav_msgs/Path.
CdrWriter PathMessage(const MessageHeader& header, const std::vector<StampedPose>& poses,
                      const Rigid3& map_from_world);
// sensor_msgs/PointCloud2.
CdrWriter LandmarksMessage(const MessageHeader& header, const Map& map,
                           const Rigid3& map_from_world);
// visualization_msgs/MarkerArray: the ellipsoids of the objects, and their names.
CdrWriter MarkersMessage(const MessageHeader& header, const Map& map, const ClassNames& names,
                         const Rigid3& map_from_world);
// vision_msgs/Detection3DArray.
CdrWriter ObjectsMessage(const MessageHeader& header, const Map& map, const ClassNames& names,
                         const Rigid3& map_from_world);
// vision_msgs/Detection2DArray.
CdrWriter DetectionsMessage(const MessageHeader& header, const std::vector<Detection>& detections,
                            const ClassNames& names);
// sensor_msgs/CompressedImage: a JPEG.
CdrWriter PictureMessage(const MessageHeader& header, const cv::Mat& picture);
// sensor_msgs/CameraInfo of an image without distortion.
CdrWriter CameraInfoMessage(const MessageHeader& header, const cv::Size& size, const Camera& c);
// rcl_interfaces/Log: a sentence for people.
CdrWriter EventMessage(int64_t stamp, bool is_warning, const std::string& text);
// diagnostic_msgs/DiagnosticArray.
CdrWriter DiagnosticsMessage(int64_t stamp, const std::vector<Diagnostic>& all);

}  // namespace oaslam
