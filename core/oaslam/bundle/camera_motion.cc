#include "oaslam/bundle/camera_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>

namespace oaslam {

CameraMotion::CameraMotion(const Map& map, std::span<const FramePose> trajectory) {
  for (const FramePose& frame : trajectory)
    if (const auto reference = map.ResolvePose(frame.reference))
      poses_.push_back({frame.timestamp, frame.cam_from_reference * *reference});
  std::ranges::stable_sort(poses_, {}, &TimedPose::timestamp);
}

std::optional<CameraVelocity> CameraMotion::At(double timestamp) const {
  constexpr double kMaxGapS = 0.3;  // a hand's motion changes within about this time
  const auto here = std::ranges::lower_bound(poses_, timestamp, {}, &TimedPose::timestamp);
  if (here == poses_.end() || here->timestamp != timestamp) return std::nullopt;
  const bool has_before =
      here != poses_.begin() && timestamp - std::prev(here)->timestamp < kMaxGapS;
  const bool has_after =
      std::next(here) != poses_.end() && std::next(here)->timestamp - timestamp < kMaxGapS;
  const TimedPose& from = has_before ? *std::prev(here) : *here;
  const TimedPose& to = has_after ? *std::next(here) : *here;
  const double seconds = to.timestamp - from.timestamp;
  if (!(seconds > 0)) return std::nullopt;
  const Rigid3 motion = to.cam_from_world * from.cam_from_world.Inverse();
  const Eigen::AngleAxisd turn(motion.rotation);
  return CameraVelocity{motion.translation / seconds, turn.axis() * (turn.angle() / seconds)};
}

}  // namespace oaslam
