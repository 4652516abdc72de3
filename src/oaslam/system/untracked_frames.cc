#include <ranges>
#include <utility>

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

// Tracks the frames that came before the initial map: forward from the first keyframe to the
// second, and backward from the first until tracking fails.
void Tracker::FillInBeforeMap(const std::vector<Frame>& frames, const Map& map) {
  // Pixels of the lowest level: wide, since the prediction is the pose of the neighbour in time.
  constexpr double kWindow = 30;
  const KeyframeId first = trajectory_.poses().front().reference;
  const Keyframe& keyframe = map.keyframes.At(first);
  const std::shared_ptr<const FrameMotion>& now = last_->frame.motion;
  const auto fill_in = [&](auto&& some) {
    std::shared_ptr<const Features> features = keyframe.features;
    std::vector<LandmarkId> landmarks = keyframe.landmarks;
    Rigid3 pose = keyframe.cam_from_world;
    bool is_tracked = true;
    for (const Frame& frame : some) {
      TrackReport report;
      if (is_tracked) report = TrackFromLastFrame(frame, map, *features, landmarks, pose, kWindow);
      if (report.success) report = TrackLocalMap(frame, map, report, Demands());
      if (report.success) {
        features = frame.features;
        landmarks = report.landmarks;
        pose = report.cam_from_world;
      } else {
        if (frame.index < keyframe.frame_index) is_tracked = false;
        // The map has the frame of the odometry, whose first poses are better than none.
        if (!frame.motion || !now || frame.motion->run != now->run) continue;
        report.cam_from_world = frame.motion->cam_from_odom;
      }
      trajectory_.Add(
          {frame.index, frame.timestamp, first, RelativeTo(map, first, report.cam_from_world),
           report.success ? TrackingState::kTracking : TrackingState::kPreliminary},
          frame, report.landmarks);
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
