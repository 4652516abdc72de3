#include "oaslam/tracking/frames_before_map.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <ranges>
#include <utility>

#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

// The pose of an image before the map, in the frame of the odometry as it is known with image
// `now`: between the images before and after it whose poses were corrected, or as it was given
// relative to the nearest of them.
Rigid3 CorrectedPose(const FrameMotion& image, const std::vector<Frame>& frames,
                     const FrameMotion& now) {
  const auto after =
      std::ranges::lower_bound(now.keyframes, image.image, {}, &std::pair<int, Rigid3>::first);
  if (after == now.keyframes.end()) return image.cam_from_odom;
  if (after->first == image.image) return after->second;
  if (after != now.keyframes.begin()) {
    const auto& [first, from] = *std::prev(after);
    const Rigid3& to = after->second;
    const double share = (image.image - first) / static_cast<double>(after->first - first);
    const auto rotation = from.rotation.slerp(share, to.rotation);
    const Eigen::Vector3d center =
        from.OriginInSource() + share * (to.OriginInSource() - from.OriginInSource());
    return Rigid3(rotation, rotation * -center);
  }
  for (const Frame& frame : frames)
    if (frame.motion && frame.motion->run == now.run && frame.motion->image == after->first)
      return image.cam_from_odom * frame.motion->cam_from_odom.Inverse() * after->second;
  return image.cam_from_odom;
}

}  // namespace

std::vector<FrameBeforeMap> PlaceFramesBeforeMap(const std::vector<Frame>& frames, const Map& map,
                                                 KeyframeId first, const FrameMotion& now,
                                                 double depth, const TrackDemands& demands) {
  constexpr double kWindow = 30;  // pixels of the lowest level
  // A map of two keyframes tells little: shares of the way from the first one and of the depth;
  // rad.
  constexpr double kOfWay = 0.15, kOfDepth = 0.02, kTurn = 0.02;
  const Keyframe& keyframe = map.keyframes.At(first);
  std::vector<FrameBeforeMap> placed;
  const auto place = [&](auto&& some) {
    std::shared_ptr<const Features> features = keyframe.features;
    std::vector<LandmarkId> landmarks = keyframe.landmarks;
    bool is_tracked = true;
    for (const Frame& frame : some) {
      if (!frame.motion || frame.motion->run != now.run) continue;
      const Rigid3 expected = CorrectedPose(*frame.motion, frames, now);
      TrackReport report;
      if (is_tracked)
        report = TrackFromLastFrame(frame, map, *features, landmarks, expected, kWindow);
      if (report.success) report = TrackLocalMap(frame, map, report, demands);
      const PoseVector off = StepOf(report.cam_from_world * expected.Inverse());
      const double way =
          (expected.OriginInSource() - keyframe.cam_from_world.OriginInSource()).norm();
      report.success = report.success && off.head<3>().norm() < kOfWay * way + kOfDepth * depth &&
                       off.tail<3>().norm() < kTurn;
      if (report.success) {
        features = frame.features;
        landmarks = report.landmarks;
      } else {
        if (frame.index < keyframe.frame_index) is_tracked = false;
        report.cam_from_world = expected;
        report.landmarks.clear();
      }
      placed.push_back({frame,
                        {frame.index, frame.timestamp, first,
                         report.cam_from_world * keyframe.cam_from_world.Inverse(),
                         report.success ? TrackingState::kTracking : TrackingState::kPreliminary},
                        std::move(report.landmarks)});
    }
  };
  place(frames |
        std::views::filter([&](const Frame& frame) { return frame.index > keyframe.frame_index; }));
  place(frames | std::views::reverse |
        std::views::filter([&](const Frame& frame) { return frame.index < keyframe.frame_index; }));
  return placed;
}

}  // namespace oaslam
