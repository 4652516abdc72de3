#pragma once

#include "oaslam/config.h"

namespace oaslam {

struct KeyframeEvidence {
  double seconds_since_keyframe = 0;
  bool mapper_idle = true;       // the last keyframe is in the snapshot
  int matched = 0, inliers = 0;  // landmarks of this frame, and those that agree with its pose
  int reference_landmarks = 0;   // of the reference keyframe, well observed
  int inliers_at_keyframe = 0;   // of the newest keyframe, when it became one
};

enum class KeyframeNeed {
  kNone,
  kWanted,
  kUrgent,  // the view changes so fast that the next frame needs its landmarks: the mapper is
            // waited for
};

// Whether a frame should become a keyframe: it sees fewer than `keyframe_inlier_ratio` of what its
// reference does, or the last one is long ago, and tracking is sound.
KeyframeNeed NeedsKeyframe(const KeyframeEvidence& evidence, const TrackingConfig& config);

}  // namespace oaslam
