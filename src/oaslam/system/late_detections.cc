// Detections that arrive after their frame was processed, as from a detector that is slower than
// the camera.

#include <algorithm>
#include <utility>

#include "oaslam/system/tracker.h"

namespace oaslam {

std::optional<Tracker::Outcome> Tracker::AddDetections(int frame_index,
                                                       std::vector<ObjectDetection> detections,
                                                       const Map& map) {
  const auto found = std::ranges::find(undetected_, frame_index,
                                       [](const Undetected& u) { return u.tracked.frame.index; });
  if (found == undetected_.end()) return std::nullopt;
  Undetected late = std::move(*found);
  undetected_.erase(undetected_.begin(), found + 1);
  late.tracked.frame.detections = std::move(detections);
  if (!late.has_pose)
    return phase_ == Phase::kLost ? std::optional(FindLate(late.tracked.frame, map)) : std::nullopt;
  const auto reference = map.ResolvePose(late.tracked.reference);
  if (!reference) return std::nullopt;
  late.tracked.cam_from_world = late.tracked.cam_from_reference * *reference;
  Outcome outcome = Outcome::Tracked(TrackingState::kTracking, late.tracked.cam_from_world, 0,
                                     late.tracked.inliers);
  outcome.objects = Associate(late.tracked, map);
  return outcome;
}

// Looks in an earlier frame for the pose of a camera that has been lost since.
Tracker::Outcome Tracker::FindLate(const Frame& frame, const Map& map) {
  if (relocalized_frame_ && frame.index <= *relocalized_frame_) return {};
  const Relocalization found =
      relocalizer_.Find(frame, map, relocalization_mode_, frame.gravity_in_cam, rng_);
  Outcome outcome;
  if (found.evidence == PoseEvidence::kNone) return outcome;
  if (found.evidence == PoseEvidence::kObjects) {
    // A frame that was placed by other means has a better pose.
    const bool has_pose = trajectory_.PoseOf(frame.index) != nullptr;
    if (!has_pose && found.relative_sigma <= config_.tracking.max_object_sigma)
      outcome = ShowObjectPose(frame, map, found);
    outcome.located = LocatedPose{found.cam_from_world, found.sigma_position};
    AddToRegistration(frame, map, *outcome.located);
    return outcome;
  }
  const TrackReport tracked = TrackFound(frame, map, found);
  if (!tracked.success) return outcome;
  relocalized_frame_ = newest_.frame.index;  // the probation lasts from the newest frame on
  relocalized_time_ = newest_.frame.timestamp;
  Remember(frame, map, tracked, TrackingState::kRelocalized);
  outcome = Outcome::Tracked(TrackingState::kRelocalized, tracked.cam_from_world, tracked.matched,
                             tracked.inliers);
  outcome.depth = tracked.depth;
  StateCertainty(frame, map, tracked.covariance, tracked.reference, outcome);
  outcome.objects = Associate({frame, tracked.cam_from_world, tracked.reference,
                               last_->cam_from_reference, tracked.landmarks, tracked.inliers},
                              map);
  return outcome;
}

}  // namespace oaslam
