#pragma once

#include "oaslam/config.h"

namespace oaslam {

struct KeyframeEvidence {
  int frames_since_keyframe = 0;
  bool mapper_idle = true;         // the last keyframe is in the snapshot
  int matched = 0, inliers = 0;    // landmarks of this frame, and those that agree with its pose
  int reference_landmarks = 0;     // of the reference keyframe, well observed
};

// Whether a frame should become a keyframe: it sees fewer than `keyframe_inlier_ratio` of what its reference does, or the last one is
// long ago, and tracking is sound.
bool NeedsKeyframe(const KeyframeEvidence& evidence, const TrackingConfig& config);

}  // namespace oaslam
