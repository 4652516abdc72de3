#include "oaslam/tracking/keyframe_decision.h"

#include <algorithm>
#include <cmath>

namespace oaslam {
namespace {

// Seconds between two keyframes: at least, unless much of the view is new, which leaves time for
// mapping; and at most, however little the view changes.
constexpr double kMinInterval = 0.1, kMaxInterval = 1;
// Share of the reference keyframe's landmarks; an image that sees fewer becomes a keyframe.
constexpr double kInlierRatio = 0.9;

}  // namespace

KeyframeNeed NeedsKeyframe(const KeyframeEvidence& evidence) {
  constexpr double kTimeSlack = 1e-3;  // seconds: time stamps are rounded
  const bool is_time = evidence.seconds_since_keyframe > kMinInterval - kTimeSlack;
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
  if (evidence.seconds_since_keyframe > kMaxInterval - kTimeSlack) return KeyframeNeed::kWanted;
  // A view that is mostly new or has few landmarks becomes a keyframe at once. Otherwise keyframes
  // are at least kMinInterval apart, to leave the mapper time.
  if (ratio < kThin || evidence.inliers < 3 * kMinInliers) return KeyframeNeed::kWanted;
  return is_time && ratio < kInlierRatio ? KeyframeNeed::kWanted : KeyframeNeed::kNone;
}

void KeyframeDecision::Watch(const Frame& frame) {
  if (frame.motion && frame.motion->is_keyframe) view_has_changed_ = true;
}

KeyframeNeed KeyframeDecision::Need(const Frame& frame, const Map& map, const TrackReport& tracked,
                                    TrackingState state, const OdometryLink& link) const {
  KeyframeEvidence evidence{.seconds_since_keyframe = std::abs(frame.timestamp - newest_at_),
                            .mapper_idle = !newest_.IsValid() || map.keyframes.Contains(newest_) ||
                                           map.retired.Contains(newest_),
                            .matched = tracked.matched,
                            .inliers = tracked.inliers,
                            .reference_landmarks = map.CountTrackedLandmarks(
                                tracked.reference, map.keyframes.size() > 2 ? 3 : 2),
                            .inliers_at_keyframe = newest_inliers_};
  if (state == TrackingState::kOdometry) {
    const auto motion = link.MotionSinceKeyframe(frame);
    evidence.view_has_changed = view_has_changed_ && motion && !motion->is_turn;
  }
  return NeedsKeyframe(evidence);
}

void KeyframeDecision::Made(KeyframeId id, double timestamp, int inliers) {
  newest_ = id;
  newest_at_ = timestamp;
  newest_inliers_ = inliers;
  view_has_changed_ = false;
}

}  // namespace oaslam
