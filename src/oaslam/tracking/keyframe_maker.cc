#include "oaslam/tracking/keyframe_maker.h"

#include <cmath>

namespace oaslam {

void KeyframeMaker::Watch(const Frame& frame) {
  if (frame.motion && frame.motion->is_keyframe) view_has_changed_ = true;
}

KeyframeNeed KeyframeMaker::Need(const Frame& frame, const Map& map, const TrackReport& tracked,
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

void KeyframeMaker::Made(KeyframeId id, double timestamp, int inliers) {
  newest_ = id;
  newest_at_ = timestamp;
  newest_inliers_ = inliers;
  view_has_changed_ = false;
}

}  // namespace oaslam
