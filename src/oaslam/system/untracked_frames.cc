#include <algorithm>
#include <iterator>
#include <limits>
#include <ranges>
#include <utility>

#include "oaslam/system/tracker.h"

// Poses that are found afterwards: those before the initial map, and those in which the camera was
// lost.
namespace oaslam {
namespace {

// The search radius in pixels of the lowest level. It is wide, since the prediction is the pose
// of the neighbour in time.
constexpr double kWindow = 30;

// Tracks a frame from its neighbour in time, then in the local map.
TrackReport TrackFromNeighbour(const Frame& frame, const Map& map, const Features& features,
                               const std::vector<LandmarkId>& landmarks,
                               const Rigid3& cam_from_world, const TrackDemands& demands) {
  const TrackReport report =
      TrackFromLastFrame(frame, map, features, landmarks, cam_from_world, kWindow);
  return report.success ? TrackLocalMap(frame, map, report, demands) : TrackReport{};
}

}  // namespace

void Tracker::KeepLost(const Frame& frame) {
  constexpr size_t kMost = 450;  // 15 s at 30 Hz; the odometry drifts
  if (frame.motion) lost_images_.push_back({frame.index, frame.timestamp, frame.motion});
  if (lost_images_.size() > kMost) lost_images_.erase(lost_images_.begin());
}

// Tracks the frames that came before the initial map: forward from the first keyframe to the
// second, and backward from the first until tracking fails.
void Tracker::FillInBeforeMap(const Map& map) {
  const KeyframeId first = trajectory_.poses().front().reference;
  const Keyframe& keyframe = map.keyframes.At(first);
  const std::shared_ptr<const FrameMotion>& now = last_->frame.motion;
  const auto fill_in = [&](const auto& frames) {
    std::shared_ptr<const Features> features = keyframe.features;
    std::vector<LandmarkId> landmarks = keyframe.landmarks;
    Rigid3 pose = keyframe.cam_from_world;
    bool is_tracked = true;
    for (const Frame& frame : frames) {
      TrackReport report;
      if (is_tracked)
        report =
            TrackFromNeighbour(frame, map, *features, landmarks, pose,
                               {.inliers = config_.tracking.min_inliers, .spread = LeastSpread()});
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
  const std::vector<Frame> frames = std::exchange(before_map_, {});
  const auto from_first = std::ranges::lower_bound(frames, keyframe.frame_index, {}, &Frame::index);
  const bool has_first = from_first != frames.end() && from_first->index == keyframe.frame_index;
  fill_in(std::ranges::subrange(has_first ? std::next(from_first) : from_first, frames.end()));
  fill_in(std::ranges::subrange(std::make_reverse_iterator(from_first), frames.rend()));
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

void Tracker::RefineTrajectory(const Map& map) {
  trajectory_.RefinePosesBefore(map, std::numeric_limits<int>::max());
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
