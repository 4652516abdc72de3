#include "robot_view.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdlib>

#include "oaslam/formats/text.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

constexpr uint32_t kMostDomain = 232;  // of the ports that DDS has

// --domain, else ROS_DOMAIN_ID, else 0.
uint32_t DomainOf(const std::optional<uint32_t>& given) {
  const char* variable = std::getenv("ROS_DOMAIN_ID");
  if (given || !variable || !*variable) return given.value_or(0);
  const auto number = ParseNumber(variable);
  if (!number || !(*number >= 0 && *number <= kMostDomain) ||
      *number != static_cast<uint32_t>(*number))
    throw BadInput("ROS_DOMAIN_ID: {}, allowed: 0 to {}", variable, kMostDomain);
  return static_cast<uint32_t>(*number);
}

// The nodes of ROS 2 that were told to stay on this machine would not be met otherwise, and others
// must not hear what is published.
void StayOnThisMachine() {
  const auto is = [](const char* variable, const char* value) {
    const char* given = std::getenv(variable);
    return given && std::string(given) == value;
  };
  const bool is_asked =
      is("ROS_LOCALHOST_ONLY", "1") || is("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
  constexpr int kKeep = 0;  // what CYCLONEDDS_URI says
  if (is_asked) setenv("CYCLONEDDS_URI", kLoopbackOnly, kKeep);
}

}  // namespace

void RobotView::AddOptions(CLI::App& run) {
  LiveView::AddOptions(run);
  const auto frame = [&](const char* name, std::string& value, const char* what) {
    run.add_option(name, value, what)->type_name("FRAME")->capture_default_str();
  };
  run.add_option("--domain", domain_, "by default ROS_DOMAIN_ID, else 0")
      ->check(CLI::Range(0U, kMostDomain));
  frame("--map-frame", options_.frames.map, "frame of the map");
  frame("--odom-frame", options_.frames.odom, "frame of the robot's odometry");
  frame("--base-frame", options_.frames.base, "frame of the robot");
  run.add_flag("--publish-camera-tf", options_.frames.publishes_camera,
               "publish map -> camera, for a camera that is no part of a robot");
  run.add_option("--tf-ahead", options_.frames.tf_ahead_s,
                 "seconds by which map -> odom is later than its image, for those who ask for the "
                 "present")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 10.0));
  run.add_flag("--read-only", is_read_only_, "do not change the map of --map-in")
      ->needs("--map-in");
}

void RobotView::Check() {
  LiveView::Check();
  options_.domain = DomainOf(domain_);
  StayOnThisMachine();
  options_.is_mapping = !is_read_only_;
  node_ = std::make_unique<RobotNode>(options_);
}

std::optional<Camera> RobotView::CameraOfSource(const std::string&) {
  return node_->WaitForCamera();
}

// Before the first image, when all is known that the robot tells.
void RobotView::SetUp(Slam& slam) {
  is_set_up_ = true;
  names_ = slam.Snapshot().CategoryNames();
  if (is_read_only_) slam.SetMapping(false);
  if (!node_->HasImu()) return;
  const std::optional<Rigid3> cam_from_imu = node_->WaitForImu();
  if (!cam_from_imu)
    spdlog::warn(
        "IMU: /tf_static does not tell how it lies to the camera: its axes are taken to be the "
        "camera's");
  cam_from_imu_ = cam_from_imu.value_or(Rigid3());
  slam.SetImu(cam_from_imu_);
}

void RobotView::Prepare(Slam& slam, FrameInput& frame) {
  if (!is_set_up_) SetUp(slam);
  if (node_->BeganAnew(frame.index)) slam.ForceRelocalization();
  if (!node_->HasImu()) return;
  std::vector<ImuSample> samples = node_->TakeImu(frame.input.timestamp);
  // A gyroscope alone has zeros for its accelerations.
  has_acceleration_ = has_acceleration_ || std::ranges::any_of(samples, [](const ImuSample& s) {
                        return !s.acceleration.isZero(0);
                      });
  if (has_acceleration_) {
    frame.input.imu = std::move(samples);
    return;
  }
  for (const ImuSample& sample : samples)
    frame.input.angular_velocity.push_back(
        {sample.timestamp, cam_from_imu_.rotation * sample.angular_velocity});
}

void RobotView::Show(const Slam& slam, const FrameInput& frame, const TrackingResult& result,
                     int dropped) {
  LiveView::Show(slam, frame, result, dropped);
  const MapSnapshot map = slam.Snapshot();
  node_->Publish({.image = frame.index,
                  .frame = result.frame,
                  .state = ToString(result.state),
                  .is_lost = IsLost(result.state),
                  .world = map.world(),
                  .world_from_cam = result.PoseIn(map.world()),
                  .covariance = result.covariance,
                  .map = MapOf(map),
                  .imu_problem = node_->HasImu() ? slam.Imu().problem : ""},
                 names_);
  if (!frame.input.detections_follow && result.detections > 0)
    node_->PublishDetections(result.frame, frame.input.detections, names_);
}

void RobotView::ShowLate(int frame, const std::vector<Detection>& detections) {
  node_->PublishDetections(frame, detections, names_);
}

void RobotView::Finish(const SavedMap& saved, bool interrupted) {
  LiveView::Finish(saved, interrupted);
  node_->Leave();
}

}  // namespace oaslam::apps
