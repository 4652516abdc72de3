#pragma once

#include <optional>

#include "oaslam/map/map.h"
#include "oaslam/tracking/odometry_link.h"
#include "oaslam/tracking/pose_tracking.h"

namespace oaslam {

struct KeyframeEvidence {
  double seconds_since_keyframe = 0;
  bool mapper_idle = true;       // the last keyframe is in the snapshot
  int matched = 0, inliers = 0;  // landmarks of this frame, and those that agree with its pose
  int reference_landmarks = 0;   // of the reference keyframe: those with enough observations
  int inliers_at_keyframe = 0;   // of the newest keyframe, when it became one
  // Where the pose is by odometry: whether the view has changed since the newest keyframe.
  std::optional<bool> view_has_changed{};
};

enum class KeyframeNeed {
  kNone,
  kWanted,
  // The view changes so fast that the next frame needs the landmarks of this one: the tracker waits
  // for the mapper.
  kUrgent,
};

// Whether a frame should become a keyframe: tracking is reliable, and the frame sees fewer than
// nine tenths of its reference's landmarks or the last keyframe is a second ago. Where hardly any
// landmark is in view and the pose is by odometry, a frame becomes a keyframe whenever the view has
// changed, so that the map gets landmarks there.
KeyframeNeed NeedsKeyframe(const KeyframeEvidence& evidence);

// Decides which images become keyframes, by what has changed since the newest one.
class KeyframeDecision {
 public:
  // Takes note of the newest image's motion.
  void Watch(const Frame& frame);
  // Whether an image with a pose should become a keyframe.
  KeyframeNeed Need(const Frame& frame, const Map& map, const TrackReport& tracked,
                    TrackingState state, const OdometryLink& link) const;
  // Notes that an image has become a keyframe; `inliers`: the landmarks that agree with its pose.
  void Made(KeyframeId id, double timestamp, int inliers);

 private:
  KeyframeId newest_;
  double newest_at_ = 0;  // time stamp
  int newest_inliers_ = 0;
  bool view_has_changed_ = false;  // since the newest keyframe (FrameMotion::is_keyframe)
};

}  // namespace oaslam
