#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "oaslam/exports/result_messages.h"
#include "oaslam/exports/ros_map_frame.h"
#include "oaslam/ros2/image_clock.h"
#include "oaslam/ros2/robot_pose.h"
#include "oaslam/ros2/transform_buffer.h"

namespace oaslam {

// The frames of a robot, and which transforms to them are published.
struct RobotFrames {
  std::string map = "map", odom = "odom", base = "base_link";
  bool publishes_camera = false;  // map -> camera, for a camera that is no part of a robot
  double tf_ahead_s = 0;          // by which transforms are later than their image
};

// What SLAM found in an image.
struct RobotResult {
  int image = 0;  // InputImage::index
  int frame = 0;  // TrackingResult::frame
  std::string state{};
  bool is_lost = false;
  WorldId world{};
  std::optional<Rigid3> world_from_cam{};
  PoseCovariance covariance = PoseCovariance::Zero();
  std::shared_ptr<const Map> map{};
  std::string imu_problem{};  // ImuCalibration::problem
};

enum class RobotTopic { kTransforms, kPose, kOdometry, kPath, kMarkers, kObjects };

// Makes messages of the results: poses of the robot where its frames are known and the map is in
// metres, as they are, else of the camera; `map` to `odom` where the map is in metres and all
// frames are known; path and objects when they have changed. A pose whose frames are not told yet
// at its time waits for them.
class RobotResults {
 public:
  using Write = std::function<void(RobotTopic, const CdrWriter&)>;
  RobotResults(RobotFrames frames, Write write)
      : frames_(std::move(frames)), write_(std::move(write)) {}

  // `image`: the stamp and frame of the image.
  void Add(const RobotResult& result, const MessageHeader& image, const ImageClock& clock,
           const TransformBuffer& transforms, const ClassNames& names);
  // Publishes what waited for these transforms.
  void Place(const TransformBuffer& transforms);
  // Forgets what waits, as where the clock began anew.
  void Forget();
  // Whether the poses, or `map` to `odom`, have waited for longer than usual.
  bool WaitsForBase() const { return Waits(&Unplaced::has_pose); }
  bool WaitsForOdom() const { return Waits(&Unplaced::has_odom); }

 private:
  struct Unplaced {
    MessageHeader image;
    WorldId world{};
    Rigid3 map_from_cam{};
    PoseCovariance covariance{};
    bool is_metric = false, is_lost = false;
    double since_s = 0;  // when it was found
    bool has_pose = false, has_odom = false;
  };

  bool Waits(bool Unplaced::*done) const;
  // These return false where /tf does not tell that time yet.
  bool PlacePose(const Unplaced& pose, const TransformBuffer& transforms);
  bool PlaceOdom(const Unplaced& pose, const TransformBuffer& transforms);
  void WriteTransform(int64_t stamp, const std::string& child, const Rigid3& pose);
  void WriteMap(const RobotResult& result, const MessageHeader& image, const ImageClock& clock,
                const TransformBuffer& transforms, const ClassNames& names);

  const RobotFrames frames_;
  const Write write_;
  RosMapFrame map_frame_;
  std::deque<Unplaced> unplaced_;
  struct {
    int64_t stamp = 0;
    WorldId world{};
    std::string frame{};  // whose pose it is
    RobotPose pose{};
  } last_;
  std::optional<Rigid3> map_from_odom_;
  std::optional<uint64_t> version_;  // of the map that was written
  WorldId map_world_;
  double next_map_s_ = 0;
};

}  // namespace oaslam
