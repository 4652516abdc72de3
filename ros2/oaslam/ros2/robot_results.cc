#include "oaslam/ros2/robot_results.h"

#include <algorithm>
#include <numbers>

#include "oaslam/storage/map_file.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {

void RobotResults::Add(const RobotResult& result, const MessageHeader& image,
                       const ImageClock& clock, const TransformBuffer& transforms,
                       const ClassNames& names) {
  if (!result.map) return;
  if (const double angle = map_frame_.Follow(*result.map, result.world); angle > 0) {
    Log(LogLevel::kInfo, "{} was turned by {:.1f} degrees: its vertical is known better",
        frames_.map, angle * 180 / std::numbers::pi);
    Forget();  // its poses are in the axes before
  }
  if (result.world != map_world_) map_from_odom_.reset();
  WriteMap(result, image, clock, transforms, names);
  if (result.world_from_cam) {
    constexpr size_t kMostWaiting = 200;
    unplaced_.push_back({image, result.world, map_frame_.map_from_world() * *result.world_from_cam,
                         result.covariance, result.map->is_metric, result.is_lost,
                         SteadySeconds()});
    if (unplaced_.size() > kMostWaiting) unplaced_.pop_front();
    Place(transforms);
  } else if (map_from_odom_) {
    WriteTransform(image.stamp, frames_.odom, *map_from_odom_);  // it stays
  }
}

void RobotResults::Place(const TransformBuffer& transforms) {
  for (Unplaced& pose : unplaced_) {
    if (!pose.has_pose) pose.has_pose = PlacePose(pose, transforms);
    if (pose.has_pose && !pose.has_odom) pose.has_odom = PlaceOdom(pose, transforms);
  }
  constexpr double kLongest = 5;  // seconds; what /tf has not told by then, it will not tell
  const double now = SteadySeconds();
  std::erase_if(unplaced_, [&](const Unplaced& pose) {
    return pose.has_odom || now - pose.since_s > kLongest;
  });
}

void RobotResults::Forget() {
  unplaced_.clear();
  last_ = {};
}

bool RobotResults::Waits(bool Unplaced::*done) const {
  constexpr double kLong = 1;  // seconds
  return std::ranges::any_of(unplaced_, [&](const Unplaced& pose) {
    return !(pose.*done) && SteadySeconds() - pose.since_s > kLong;
  });
}

bool RobotResults::PlacePose(const Unplaced& pose, const TransformBuffer& transforms) {
  const auto& [stamp, camera] = pose.image;
  // The robot is in metres: in a map of another unit its base would be at a wrong place.
  const bool is_of_robot = pose.is_metric && transforms.Connects(frames_.base, camera);
  const auto base_from_cam =
      is_of_robot ? transforms.Find(frames_.base, camera, stamp) : std::nullopt;
  if (is_of_robot && !base_from_cam) return false;
  const std::string& frame = base_from_cam ? frames_.base : camera;
  const RobotPose now =
      PoseOfFrame(pose.map_from_cam, pose.covariance, base_from_cam.value_or(Rigid3()));
  const MessageHeader header{stamp, frames_.map};
  write_(RobotTopic::kPose, PoseMessage(header, now.map_from_frame, now.covariance));
  constexpr double kLongest = 0.5;  // seconds between poses that tell a velocity
  const double seconds = 1e-9 * static_cast<double>(stamp - last_.stamp);
  if (seconds > 0 && seconds <= kLongest && pose.world == last_.world && frame == last_.frame)
    write_(RobotTopic::kOdometry, OdometryMessage(header, frame, now.map_from_frame, now.covariance,
                                                  TwistBetween(last_.pose, now, seconds)));
  last_ = {stamp, pose.world, frame, now};
  if (frames_.publishes_camera && !transforms.HasParent(camera))
    WriteTransform(stamp, camera, pose.map_from_cam);
  return true;
}

bool RobotResults::PlaceOdom(const Unplaced& pose, const TransformBuffer& transforms) {
  const auto& [stamp, camera] = pose.image;
  const auto base_from_cam = transforms.Find(frames_.base, camera, stamp);
  if (!base_from_cam || !pose.is_metric || pose.is_lost ||
      !transforms.Connects(frames_.odom, frames_.base))
    return true;
  const auto odom_from_base = transforms.Find(frames_.odom, frames_.base, stamp);
  if (!odom_from_base) return false;
  map_from_odom_ = MapFromOdom(pose.map_from_cam * base_from_cam->Inverse(), *odom_from_base);
  WriteTransform(stamp, frames_.odom, *map_from_odom_);
  return true;
}

void RobotResults::WriteTransform(int64_t stamp, const std::string& child, const Rigid3& pose) {
  const auto ahead = static_cast<int64_t>(frames_.tf_ahead_s * 1e9);
  write_(RobotTopic::kTransforms, TransformMessage({stamp + ahead, frames_.map}, child, pose));
}

// When it has changed, at most once a second, and less often as it grows.
void RobotResults::WriteMap(const RobotResult& result, const MessageHeader& image,
                            const ImageClock& clock, const TransformBuffer& transforms,
                            const ClassNames& names) {
  constexpr double kInterval = 1, kBytesPerSecond = 1e6, kKeyframe = 100, kObject = 1000;
  const Map& map = *result.map;
  const double now = clock.Seconds(image.stamp);
  if (version_ && result.world == map_world_ && (map.version == *version_ || now < next_map_s_))
    return;
  version_ = map.version;
  map_world_ = result.world;
  const double bytes =
      kKeyframe * static_cast<double>(map.keyframes.size()) + kObject * map.CountMappedObjects();
  next_map_s_ = now + std::max(kInterval, bytes / kBytesPerSecond);
  const auto cam_from_base =
      map.is_metric ? transforms.Find(image.frame, frames_.base, image.stamp) : std::nullopt;
  std::vector<StampedPose> poses = KeyframePoses(map);
  for (StampedPose& pose : poses) {
    pose.timestamp = 1e-9 * static_cast<double>(clock.StampOf(pose.timestamp));
    if (cam_from_base) pose.world_from_cam = pose.world_from_cam * *cam_from_base;
  }
  const MessageHeader header{image.stamp, frames_.map};
  const Rigid3 map_from_world = map_frame_.map_from_world();
  write_(RobotTopic::kPath, PathMessage(header, poses, map_from_world));
  write_(RobotTopic::kMarkers, MarkersMessage(header, map, names, map_from_world));
  write_(RobotTopic::kObjects, ObjectsMessage(header, map, names, map_from_world));
}

}  // namespace oaslam
