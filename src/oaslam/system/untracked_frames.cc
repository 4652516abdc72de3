#include <algorithm>
#include <iterator>
#include <ranges>
#include <utility>

#include "oaslam/geometry/pose_step.h"
#include "oaslam/system/tracker.h"

// Poses that are found afterwards: those before the initial map, and those in which the camera was
// lost.
namespace oaslam {

void Tracker::KeepLost(const Frame& frame) {
  constexpr size_t kMost = 450;  // 15 s at 30 Hz; the odometry drifts
  const bool is_new = lost_images_.empty() || lost_images_.back().frame_index < frame.index;
  if (frame.motion && is_new) lost_images_.push_back({frame.index, frame.timestamp, frame.motion});
  if (lost_images_.size() > kMost) lost_images_.erase(lost_images_.begin());
}

// The pose of an image before the map, in the frame of the odometry as it is known with image
// `now`: between the images before and after it whose poses were corrected, or as it was given
// relative to the nearest of them.
Rigid3 Tracker::CorrectedPose(const FrameMotion& image, const std::vector<Frame>& frames,
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

// Looks for the frames that came before the initial map about where the odometry has them: forward
// from the first keyframe to the second, and backward from the first until tracking fails.
void Tracker::FillInBeforeMap(const std::vector<Frame>& frames, const Map& map) {
  constexpr double kWindow = 30;  // pixels of the lowest level
  // A map of two keyframes tells little: shares of the way from the first one and of the depth;
  // rad.
  constexpr double kOfWay = 0.15, kOfDepth = 0.02, kTurn = 0.02;
  const KeyframeId first = trajectory_.poses().front().reference;
  const Keyframe& keyframe = map.keyframes.At(first);
  const FrameMotion& now = *last_->frame.motion;
  const auto fill_in = [&](auto&& some) {
    std::shared_ptr<const Features> features = keyframe.features;
    std::vector<LandmarkId> landmarks = keyframe.landmarks;
    bool is_tracked = true;
    for (const Frame& frame : some) {
      if (!frame.motion || frame.motion->run != now.run) continue;
      const Rigid3 expected = CorrectedPose(*frame.motion, frames, now);
      TrackReport report;
      if (is_tracked)
        report = TrackFromLastFrame(frame, map, *features, landmarks, expected, kWindow);
      if (report.success) report = TrackLocalMap(frame, map, report, Demands());
      const PoseVector off = StepOf(report.cam_from_world * expected.Inverse());
      const double way =
          (expected.OriginInSource() - keyframe.cam_from_world.OriginInSource()).norm();
      report.success = report.success && off.head<3>().norm() < kOfWay * way + kOfDepth * depth_ &&
                       off.tail<3>().norm() < kTurn;
      if (report.success) {
        features = frame.features;
        landmarks = report.landmarks;
      } else {
        if (frame.index < keyframe.frame_index) is_tracked = false;
        report.cam_from_world = expected;
      }
      trajectory_.Add(
          {frame.index, frame.timestamp, first, RelativeTo(map, first, report.cam_from_world),
           report.success ? TrackingState::kTracking : TrackingState::kPreliminary},
          frame, report.success ? report.landmarks : std::vector<LandmarkId>());
    }
  };
  fill_in(frames | std::views::filter(
                       [&](const Frame& frame) { return frame.index > keyframe.frame_index; }));
  fill_in(frames | std::views::reverse | std::views::filter([&](const Frame& frame) {
            return frame.index < keyframe.frame_index;
          }));
}

// Gives the images in which the camera was lost, and which have no pose yet, the one by the motion
// from there to this frame.
void Tracker::FillInLost(const Frame& frame, const Map& map, const TrackReport& tracked) {
  for (const LostImage& lost : std::exchange(lost_images_, {})) {
    const auto motion = MotionSince(lost.motion, frame);
    if (!motion || motion->is_turn || trajectory_.PoseOf(lost.frame_index)) continue;
    const Rigid3 cam_from_world = motion->cam_from_cam.Inverse() * tracked.cam_from_world;
    trajectory_.Add({lost.frame_index, lost.timestamp, tracked.reference,
                     RelativeTo(map, tracked.reference, cam_from_world), TrackingState::kOdometry},
                    frame, {});
  }
}

bool Tracker::HasTracked(int frame_index) const {
  const FramePose* pose = trajectory_.PoseOf(frame_index);
  return pose && pose->state != TrackingState::kObjects;
}

std::optional<Rigid3> Tracker::PoseOf(int frame_index, const Map& map) const {
  const FramePose* pose = trajectory_.PoseOf(frame_index);
  const std::optional<Rigid3> reference = pose ? map.ResolvePose(pose->reference) : std::nullopt;
  return reference ? std::optional(pose->cam_from_reference * *reference) : std::nullopt;
}

}  // namespace oaslam
