#include "oaslam/tracking/keyframe_decision.h"

#include <algorithm>

namespace oaslam {

KeyframeNeed NeedsKeyframe(const KeyframeEvidence& evidence, const TrackingConfig& config) {
  constexpr double kTimeSlack = 1e-3;  // seconds: time stamps are rounded
  const bool is_time = evidence.seconds_since_keyframe > config.min_keyframe_interval - kTimeSlack;
  if (evidence.view_has_changed)
    return *evidence.view_has_changed && is_time ? KeyframeNeed::kUrgent : KeyframeNeed::kNone;
  // A keyframe with so few landmarks would hardly constrain its pose.
  constexpr int kMinInliers = 15;
  if (evidence.inliers <= kMinInliers) return KeyframeNeed::kNone;
  // A keyframe whose pose many matches contradict would bend the map. In well tracked frames 75 to
  // 90 % of the matches agree with the pose.
  constexpr double kMinAgreement = 0.6;
  if (evidence.inliers < kMinAgreement * evidence.matched) return KeyframeNeed::kNone;
  const double ratio =
      static_cast<double>(evidence.inliers) / std::max(evidence.reference_landmarks, 1);
  // Shares of the inliers of the newest keyframe, below which its landmarks have left the view so
  // fast that the next frame may be lost; and of the reference's landmarks, below which the view is
  // mostly new.
  constexpr double kLeft = 0.75, kThin = 0.5;
  if (evidence.inliers < kLeft * evidence.inliers_at_keyframe) return KeyframeNeed::kUrgent;
  if (!evidence.mapper_idle) return KeyframeNeed::kNone;
  if (evidence.seconds_since_keyframe > config.max_keyframe_interval - kTimeSlack)
    return KeyframeNeed::kWanted;
  // A view that is mostly new or has few landmarks becomes a keyframe at once. Otherwise keyframes
  // are at least min_keyframe_interval apart, to leave the mapper time.
  if (ratio < kThin || evidence.inliers < 3 * kMinInliers) return KeyframeNeed::kWanted;
  return is_time && ratio < config.keyframe_inlier_ratio ? KeyframeNeed::kWanted
                                                         : KeyframeNeed::kNone;
}

}  // namespace oaslam
