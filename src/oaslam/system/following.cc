#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "oaslam/system/tracker.h"

// Tracking from frame to frame: searches for the pose, and keeps the state for the next frame.
namespace oaslam {
namespace {

// Poses are refined after this many frames (5 s at 30 Hz), when the map around them has settled;
// until then the matches of a frame are kept, about 5 KB each.
constexpr int kRefineAfter = 150;

}  // namespace

// A few landmarks in one corner of the image cannot tell a rotation from a sideways motion, so that
// the scale of the map drifts. Less spread is demanded where landmarks have been few and close
// together for seconds, as on an object on a plain table.
TrackDemands Tracker::Demands() const {
  // Of the usual spread; set on the doorways of the flat (docs/lab/tracking.md).
  constexpr double kShare = 0.1;
  constexpr double kEnough = 0.36;  // e.g. a hundred landmarks in a fifth of the image's width
  return {.inliers = config_.tracking.min_inliers,
          .spread = std::min(kShare * usual_spread_, kEnough)};
}

// Tracks in the local map from a first pose. Where few landmarks are in view, matches with the last
// image strengthen the result.
TrackReport Tracker::StrengthenedInLocalMap(const Frame& frame, const Map& map,
                                            const TrackReport& first,
                                            const TrackDemands& demands) const {
  TrackReport report = first.success ? TrackLocalMap(frame, map, first, demands) : TrackReport{};
  const auto reference = map.ResolvePose(last_->reference);
  if (report.success && report.inliers < kFewLandmarks && reference)
    report = StrengthenByMatches(frame, map, *last_->frame.features,
                                 last_->cam_from_reference * *reference, report, demands);
  return report;
}

// Where nothing tells how the camera moved, it is looked for about its last pose.
TrackReport Tracker::FollowWithoutMotion(const Frame& frame, const Map& map) const {
  const std::optional<Rigid3> reference = last_ ? map.ResolvePose(last_->reference) : std::nullopt;
  if (!reference) return {};
  const Rigid3 last_pose = last_->cam_from_reference * *reference;
  const TrackDemands demands = Demands();
  for (const double times : {1, 2, 4, 8}) {
    const TrackReport found = StrengthenedInLocalMap(
        frame, map,
        TrackFromLastFrame(frame, map, *last_->frame.features, last_->landmarks, last_pose,
                           times * kMotionWindow),
        demands);
    if (found.success) return found;
  }
  return {};
}

void Tracker::Remember(const Frame& frame, const Map& map, const TrackReport& tracked,
                       TrackingState state) {
  const Rigid3 cam_from_reference = RelativeTo(map, tracked.reference, tracked.cam_from_world);
  constexpr double kSpreadSeconds = 3;  // time constant of usual_spread_
  const double seconds = last_ ? std::abs(frame.timestamp - last_->frame.timestamp) : 0;
  usual_spread_ = usual_spread_ > 0 ? std::lerp(tracked.spread, usual_spread_,
                                                std::exp(-seconds / kSpreadSeconds))
                                    : tracked.spread;
  if (state != TrackingState::kOdometry) {
    LearnUnit(frame, map, tracked);
    anchors_ = {{frame.motion, tracked.reference, cam_from_reference}};
    seen_in_map_time_ = frame.timestamp;
    depth_ = tracked.depth;
  }
  if (frame.index == newest_.frame.index) newest_.landmarks = tracked.landmarks;
  last_ = Last{frame, tracked.landmarks, tracked.reference, cam_from_reference, tracked.covariance};
  trajectory_.Add({frame.index, frame.timestamp, tracked.reference, cam_from_reference, state},
                  frame, tracked.landmarks);
  trajectory_.RefinePosesBefore(map, frame.index - kRefineAfter);
  phase_ = Phase::kTracking;
  for (const LandmarkId id : tracked.visible) uses_.push_back({id, 1, 0});
  for (const LandmarkId id : tracked.landmarks)
    if (id.IsValid()) uses_.push_back({id, 0, 1});
}

}  // namespace oaslam
