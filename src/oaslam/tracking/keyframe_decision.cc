#include "oaslam/tracking/keyframe_decision.h"

namespace oaslam {

bool NeedsKeyframe(const KeyframeEvidence& evidence, const TrackingConfig& config) {
  constexpr int kMinInliers = 15;
  if (!evidence.mapper_idle || evidence.inliers <= kMinInliers) return false;
  // Sound frames agree with 75 to 90 % of their matches; a pose that so many contradict would bend the map.
  constexpr double kMinAgreement = 0.6;
  if (evidence.inliers < kMinAgreement * evidence.matched) return false;
  if (evidence.frames_since_keyframe >= config.max_frames_between_keyframes) return true;
  // Much of the view is new, or tracking grows thin: at once. Else leave the mapper a few frames.
  const double ratio = static_cast<double>(evidence.inliers) / (evidence.reference_landmarks > 0 ? evidence.reference_landmarks : 1);
  if (ratio < 0.5 || evidence.inliers < 3 * kMinInliers) return true;
  return evidence.frames_since_keyframe >= config.min_frames_between_keyframes && ratio < config.keyframe_inlier_ratio;
}

}  // namespace oaslam
