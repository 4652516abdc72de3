#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "oaslam/exports/result_messages.h"
#include "oaslam/image_source.h"
#include "oaslam/imu.h"
#include "oaslam/ros2/dds_node.h"
#include "oaslam/ros2/image_clock.h"
#include "oaslam/ros2/robot_results.h"
#include "oaslam/ros2/robot_status.h"
#include "oaslam/ros2/ros_arguments.h"
#include "oaslam/ros2/transform_buffer.h"

namespace oaslam {

struct RobotOptions {
  RosArguments names{};
  uint32_t domain = 0;
  RobotFrames frames{};
  bool is_mapping = true;  // for the status
};

// The topics of a robot: takes images, calibration, IMU and frames from ROS 2, and publishes what
// SLAM finds (docs/robots.md, "Live"). A thread takes the messages, and publishes the status once a
// second. The stamp of each message is that of its image.
class RobotNode {
 public:
  // The names of its topics on the command line, without "~/".
  static std::vector<std::string> TopicNames();

  // Throws InputError where the network cannot be used.
  explicit RobotNode(const RobotOptions& options);
  ~RobotNode();
  RobotNode(const RobotNode&) = delete;
  RobotNode& operator=(const RobotNode&) = delete;

  // The images as a camera, which ends with `options.stopped` or Stop. Throws InputError for an
  // encoding that is not read.
  std::unique_ptr<ImageSource> OpenImages(const ImageSourceOptions& options);

  // Waits for an image, and then a few seconds for its calibration and for WaitForImu. Nothing
  // where it is not calibrated. Throws InputError for a calibration that is not read.
  std::optional<Camera> WaitForCamera();
  // How the IMU lies to the camera; waits for it until a few seconds after the first image. Nothing
  // where nobody tells.
  std::optional<Rigid3> WaitForImu();
  bool HasImu() const { return !imu_topic_.empty(); }
  // The samples since the last call, as far as a little later than this time.
  std::vector<ImuSample> TakeImu(double seconds);
  // Whether the clock went back with this image.
  bool BeganAnew(int image);

  void Publish(const RobotResult& result, const ClassNames& names);
  // Of an image that Publish had: `frame`.
  void PublishDetections(int frame, const std::vector<Detection>& detections,
                         const ClassNames& names);
  // Takes leave of the other nodes, which else would wait for it. Nothing is published afterwards.
  void Leave();

 private:
  class Images;
  struct Received {
    int index = 0;
    double seconds = 0, arrived_s = 0;
    RecordedTopic topic{};
    ByteBuffer message{};
  };
  void Work(const std::stop_token& stop);
  // Reads the topic of images that is there, in the quality that is offered.
  void ChooseImages();
  void TakeImage(const RecordedMessage& message, uint64_t publisher);
  void TakeInfo(const RecordedMessage& message);
  void TakeImuSample(const RecordedMessage& message);
  void TakeTransforms(const RecordedMessage& message, bool is_static);
  void ReportStatus();
  void Write(int topic, const CdrWriter& message);
  std::optional<Rigid3> FindImu() const;
  void SayOnce(const std::string& about, const std::string& text);

  const RobotOptions options_;
  const std::string image_topic_, info_topic_, imu_topic_;
  std::unique_ptr<DdsNode> dds_;  // null once it has left
  std::map<RobotTopic, int> topics_;
  int detections_ = 0, status_topic_ = 0;

  mutable std::mutex mutex_;  // guards all below
  std::condition_variable arrived_;
  RobotStatus status_;
  ImageClock clock_;
  std::deque<Received> images_;
  std::optional<std::string> camera_frame_;
  int count_ = 0, infos_ = 0;
  struct {
    double since_s = 0;
    int images = 0, infos = 0;
  } stretch_;                             // of which the messages are counted
  std::map<int, MessageHeader> headers_;  // of the last images, by number
  std::map<int, MessageHeader> frames_;   // of the last results, by frame
  std::set<int> begun_anew_;
  std::optional<RosCameraInfo> info_;
  std::deque<std::pair<int64_t, ImuSample>> imu_;
  std::string imu_frame_;
  TransformBuffer transforms_;
  std::string read_topic_, read_type_;
  bool reads_reliably_ = false;
  std::optional<uint64_t> publisher_;
  double began_s_ = 0, first_image_s_ = 0, last_image_s_ = 0;
  std::map<std::string, int> said_;  // how often a problem was there
  RobotResults results_;

  std::jthread thread_;  // last: it uses the others
};

}  // namespace oaslam
