#include "oaslam/tracking/keyframe_decision.h"

#include <algorithm>

namespace oaslam {

KeyframeNeed NeedsKeyframe(const KeyframeEvidence& evidence, const TrackingConfig& config) {
  constexpr int kMinInliers = 15;
  constexpr double kTimeSlack = 1e-3;  // seconds: time stamps are rounded
  if (evidence.inliers <= kMinInliers) return KeyframeNeed::kNone;
  // In well tracked frames 75 to 90 % of the matches agree with the pose. A keyframe whose pose
  // many matches contradict would bend the map.
  constexpr double kMinAgreement = 0.6;
  if (evidence.inliers < kMinAgreement * evidence.matched) return KeyframeNeed::kNone;
  const double ratio =
      static_cast<double>(evidence.inliers) / std::max(evidence.reference_landmarks, 1);
  // Many of the landmarks of the newest keyframe have left the view.
  constexpr double kLeft = 0.75, kThin = 0.5;
  if (evidence.inliers < kLeft * evidence.inliers_at_keyframe) return KeyframeNeed::kUrgent;
  if (!evidence.mapper_idle) return KeyframeNeed::kNone;
  if (evidence.seconds_since_keyframe > config.max_keyframe_interval - kTimeSlack)
    return KeyframeNeed::kWanted;
  // Where much of the view is new, or few landmarks are left, a keyframe is made at once; else the
  // mapper gets min_keyframe_interval.
  if (ratio < kThin || evidence.inliers < 3 * kMinInliers) return KeyframeNeed::kWanted;
  const bool is_time = evidence.seconds_since_keyframe > config.min_keyframe_interval - kTimeSlack;
  return is_time && ratio < config.keyframe_inlier_ratio ? KeyframeNeed::kWanted
                                                         : KeyframeNeed::kNone;
}

}  // namespace oaslam
