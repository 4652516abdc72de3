#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/recordings/recording_reader.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// The messages of ROS that are read, in CDR (ROS 2) and in ROS 1's own encoding. What refers to
// bytes is valid as long as the message. All readers throw InputError for a message that is not of
// the type, or in an encoding that is not read (XCDR2).

struct RosHeader {
  int64_t stamp = 0;    // nanoseconds; 0: not set
  std::string frame{};  // without a slash at its beginning, as in ROS 2
};

// sensor_msgs/Image. The first bytes of a message suffice for all but `data`.
struct RosImage {
  RosHeader header{};
  uint32_t height = 0, width = 0, step = 0;  // pixels; bytes of a row
  std::string encoding{};
  bool is_big_endian = false;
  ByteView data{};
};

// sensor_msgs/CompressedImage.
struct RosCompressedImage {
  RosHeader header{};
  std::string format{};
  ByteView data{};
};

// sensor_msgs/CameraInfo.
struct RosCameraInfo {
  RosHeader header{};
  uint32_t height = 0, width = 0;
  std::string model{};
  std::vector<double> d{};
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  uint32_t binning_x = 0, binning_y = 0, x_offset = 0, y_offset = 0;

  bool IsCalibrated() const { return k[0] != 0; }
};

// sensor_msgs/Imu, without its covariances and orientation.
struct RosImu {
  RosHeader header{};
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero(),
                  acceleration = Eigen::Vector3d::Zero();
};

// A transform of tf2_msgs/TFMessage.
struct RosTransform {
  std::string parent, child;  // frames
  Rigid3 parent_from_child{};
  int64_t stamp = 0;  // nanoseconds
};

// vision_msgs/Detection2DArray, as from version 3 on.
struct RosDetection {
  struct Hypothesis {
    std::string class_id;
    double score = 0;
  };
  std::vector<Hypothesis> hypotheses;
  double x = 0, y = 0, theta = 0, width = 0, height = 0;  // of the box; x and y: its centre
};
struct RosDetections {
  RosHeader header{};
  std::vector<RosDetection> detections{};
};

// `part`: whether only the first bytes of the message are there.
RosImage ReadRosImage(const RecordedMessage& message, bool part);
RosCompressedImage ReadRosCompressedImage(const RecordedMessage& message, bool part);
RosCameraInfo ReadRosCameraInfo(const RecordedMessage& message);
RosImu ReadRosImu(const RecordedMessage& message);
// Without those that are no rigid motions.
std::vector<RosTransform> ReadRosTransforms(const RecordedMessage& message);
RosDetections ReadRosDetections(const RecordedMessage& message);

// The camera that an info tells: of rectified images, or of those with the distortion of the lens;
// nothing where it is not calibrated. `place` for messages. Throws InputError where the model of
// the lens is not known, its parameters are impossible, or the images are parts of what it is for.
std::optional<Camera> CameraOfInfo(const RosCameraInfo& info, bool is_rectified,
                                   const std::string& place);

}  // namespace oaslam
