#include <algorithm>
#include <iterator>
#include <limits>
#include <ranges>
#include <utility>

#include "oaslam/system/tracker.h"

// Finds poses for frames afterwards: those before the initial map, and those in which the camera
// was lost.
namespace oaslam {
namespace {

// The search radius in pixels of the lowest level. It is wide, since without a motion model the
// prediction is the pose of the neighbour in time.
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

void Tracker::KeepUntracked(const Frame& frame, bool has_pose) {
  constexpr size_t kMaxUntracked = 30;  // frames of some 50 KB; 1 s at 30 Hz
  if (backfill_) EndBackfill();         // lost again: the relocalized pose was not proven
  untracked_.push_back({frame, has_pose});
  if (untracked_.size() > kMaxUntracked) untracked_.pop_front();
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

// Tracks at most `count` lost frames backwards in time, from where the camera was relocalized.
void Tracker::FillInUntracked(const Map& map, int count) {
  for (; backfill_ && count > 0; --count) {
    if (untracked_.empty() || untracked_.back().frame.index != backfill_->index - 1)
      return EndBackfill();
    const UntrackedFrame untracked = std::move(untracked_.back());
    untracked_.pop_back();
    const Frame& frame = untracked.frame;
    TrackReport report =
        TrackFromNeighbour(frame, map, *backfill_->features, backfill_->after.landmarks,
                           backfill_->after.cam_from_world,
                           {.inliers = config_.tracking.min_inliers, .spread = LeastSpread()});
    if (!report.success) return EndBackfill();
    const Rigid3 cam_from_reference = RelativeTo(map, report.reference, report.cam_from_world);
    if (!untracked.has_pose)
      trajectory_.Add({frame.index, frame.timestamp, report.reference, cam_from_reference,
                       TrackingState::kTracking},
                      frame, report.landmarks);
    backfill_ = Backfill{frame.features, std::move(report), frame.index, true};
  }
}

void Tracker::EndBackfill() {
  backfill_.reset();
  untracked_.clear();
}

void Tracker::RefineTrajectory(const Map& map) {
  if (backfill_ && backfill_->proven) FillInUntracked(map, static_cast<int>(untracked_.size()) + 1);
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
