#include "oaslam/tracking/trajectory.h"

#include <algorithm>

#include "oaslam/estimation/pose_refinement.h"

namespace oaslam {

void Trajectory::Add(const FramePose& pose, const Frame& frame,
                     const std::vector<LandmarkId>& landmarks) {
  Put(pose);
  Unrefined unrefined{pose.frame_index, frame.camera, {}};
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const Keypoint& keypoint = frame.features->keypoints[i];
    if (landmarks[i].IsValid())
      unrefined.seen.push_back(
          {landmarks[i], keypoint.px, frame.features->pyramid.scale[keypoint.octave]});
  }
  Keep(std::move(unrefined));
}

void Trajectory::AddCarried(const FramePose& pose, int other_frame, const Rigid3& cam_from_other) {
  Put(pose);
  Keep({pose.frame_index, nullptr, {}, Carried{other_frame, cam_from_other}});
}

void Trajectory::Keep(Unrefined unrefined) {
  const int index = unrefined.frame_index;
  std::erase_if(unrefined_, [&](const Unrefined& u) { return u.frame_index == index; });
  if (unrefined.seen.empty() && !unrefined.carried) return;
  unrefined_.insert(std::ranges::upper_bound(unrefined_, index, {}, &Unrefined::frame_index),
                    std::move(unrefined));
}

void Trajectory::Put(const FramePose& pose) {
  if (FramePose* own = Find(pose.frame_index))
    *own = pose;
  else
    poses_.insert(std::ranges::upper_bound(poses_, pose.frame_index, {}, &FramePose::frame_index),
                  pose);
}

void Trajectory::MakeKeyframe(int frame_index, KeyframeId id) {
  FramePose* pose = Find(frame_index);
  if (!pose) return;
  pose->reference = id;
  pose->cam_from_reference = {};
  std::erase_if(unrefined_, [&](const Unrefined& u) { return u.frame_index == frame_index; });
}

void Trajectory::RefinePosesBefore(const Map& map, int frame_index) {
  for (; !unrefined_.empty() && unrefined_.front().frame_index < frame_index;
       unrefined_.pop_front())
    if (FramePose* pose = Find(unrefined_.front().frame_index))
      Refine(map, unrefined_.front(), *pose);
}

void Trajectory::Refine(const Map& map, const Unrefined& unrefined, FramePose& pose) {
  if (unrefined.carried) {
    const FramePose* other = PoseOf(unrefined.carried->other_frame);
    if (!other) return;
    pose.reference = other->reference;
    pose.cam_from_reference = unrefined.carried->cam_from_other * other->cam_from_reference;
    return;
  }
  // The points contradicted the motion, and may be others that look alike.
  if (pose.state == TrackingState::kOdometry) return;
  constexpr int kMinInliers = 20;  // with fewer, the pose from tracking is more certain
  // The share of a frame's landmarks that must be inliers; with fewer, the landmarks themselves
  // have changed.
  constexpr double kMinShare = 0.7;
  const std::optional<Rigid3> reference = map.ResolvePose(pose.reference);
  if (!reference) return;
  std::vector<PointObservation> observations;
  for (const Seen& s : unrefined.seen)
    if (const Landmark* landmark = map.landmarks.Find(s.landmark))
      observations.push_back({landmark->position, s.px.cast<double>(), 1.0 / (s.scale * s.scale)});
  const PoseReport refined =
      RefinePose(*unrefined.camera, pose.cam_from_reference * *reference, observations);
  if (!refined.success || refined.inliers < kMinInliers ||
      refined.inliers < kMinShare * static_cast<double>(unrefined.seen.size()))
    return;
  pose.cam_from_reference = refined.cam_from_world * reference->Inverse();
}

void Trajectory::Join(Trajectory other) {
  for (const FramePose& pose : other.poses_) Put(pose);
  for (Unrefined& unrefined : other.unrefined_) Keep(std::move(unrefined));
}

void Trajectory::Adopt(const std::vector<FramePose>& poses, double scale) {
  AdoptPoses(poses, scale, poses_);
}

void Trajectory::Scale(double factor) {
  for (FramePose& pose : poses_) pose.cam_from_reference.translation *= factor;
  for (Unrefined& unrefined : unrefined_)
    if (unrefined.carried) unrefined.carried->cam_from_other.translation *= factor;
}

void Trajectory::Scale(const std::map<KeyframeId, double>& factors) {
  const auto factor_of = [&](KeyframeId id) {
    const auto found = factors.find(id);
    return found == factors.end() ? 1.0 : found->second;
  };
  for (FramePose& pose : poses_) pose.cam_from_reference.translation *= factor_of(pose.reference);
  for (Unrefined& unrefined : unrefined_)
    if (const FramePose* pose = unrefined.carried ? PoseOf(unrefined.frame_index) : nullptr)
      unrefined.carried->cam_from_other.translation *= factor_of(pose->reference);
}

const FramePose* Trajectory::PoseOf(int frame_index) const {
  const auto place = std::ranges::lower_bound(poses_, frame_index, {}, &FramePose::frame_index);
  return place != poses_.end() && place->frame_index == frame_index ? &*place : nullptr;
}

bool Trajectory::KeepNewestAfter(int frame_index, size_t most) {
  const auto first = std::ranges::upper_bound(poses_, frame_index, {}, &FramePose::frame_index);
  const auto count = static_cast<size_t>(poses_.end() - first);
  if (count <= most + most / 8)
    return false;  // many are erased at once, since that moves all others
  poses_.erase(first, first + static_cast<std::ptrdiff_t>(count - most));
  return true;
}

void Trajectory::Clear() {
  poses_.clear();
  unrefined_.clear();
}

}  // namespace oaslam
