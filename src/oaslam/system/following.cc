#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/system/tracker.h"
#include "oaslam/util/median.h"

// Tracking from frame to frame: predicts the pose, searches for the actual one, and keeps the state
// for the next frame.
namespace oaslam {
namespace {

// Scales a motion to a fraction or multiple of its duration.
Rigid3 Fraction(const Rigid3& motion, double share) {
  if (std::abs(share - 1) < 1e-3) return motion;
  const Eigen::AngleAxisd turn(motion.rotation);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(share * turn.angle(), turn.axis())),
          share * motion.translation};
}

// The median distance between the landmarks in the image and their projections by the predicted
// pose, in pixels of the lowest level.
double PredictionError(const Frame& frame, const Map& map, const TrackReport& tracked,
                       const Rigid3& predicted) {
  const Camera& camera = map.cameras[frame.camera];
  std::vector<double> errors;
  for (size_t i = 0; i < tracked.landmarks.size(); ++i) {
    if (!tracked.landmarks[i].IsValid()) continue;
    const Eigen::Vector3d p = predicted * map.landmarks.At(tracked.landmarks[i]).position;
    if (p.z() > 0)
      errors.push_back(
          (ProjectIdeal(camera, p) - frame.features->keypoints[i].px.cast<double>()).norm());
  }
  return errors.empty() ? 0 : Median(std::move(errors)) / frame.features->pyramid.working_pixel();
}

constexpr double kProbation = 0.5;     // seconds, in which a false pose should fail
constexpr double kErrorsSearched = 4;  // times the last prediction error: the search radius
// Poses are refined after this many frames (5 s at 30 Hz), when the map around them has settled;
// until then the matches of a frame are kept, about 5 KB each.
constexpr int kRefineAfter = 150;

}  // namespace

// During its probation a relocalized pose needs as many inliers as a relocalization does.
TrackDemands Tracker::Demands(const Frame& frame) const {
  TrackDemands demands;
  demands.inliers = config_.tracking.min_inliers;
  demands.spread = LeastSpread();
  if (IsOnProbation(frame.timestamp))
    demands.inliers = demands.least_inliers = config_.tracking.min_relocalization_inliers;
  return demands;
}

// The least spread of landmarks in the image that a pose needs. A few landmarks in one corner of
// the image cannot tell a rotation from a sideways motion, so that the scale of the map drifts.
// Less spread is demanded where landmarks have been few and close together for seconds, as on an
// object on a plain table.
double Tracker::LeastSpread() const {
  // Of the usual spread; set on the doorways of the flat (docs/lab/tracking.md).
  constexpr double kShare = 0.1;
  constexpr double kEnough = 0.36;  // e.g. a hundred landmarks in a fifth of the image's width
  return std::min(kShare * usual_spread_, kEnough);
}

bool Tracker::IsOnProbation(double timestamp) const {
  return relocalized_frame_ && timestamp - relocalized_time_ <= kProbation;
}

Rigid3 Tracker::Predict(const Rigid3& last_pose, double timestamp) const {
  if (!motion_) return last_pose;
  constexpr double kMaxSteps = 3;  // after a longer gap the motion tells nothing
  const double steps = std::min((timestamp - last_->frame.timestamp) / motion_->seconds, kMaxSteps);
  return Fraction(motion_->cam_from_before, steps) * last_pose;
}

// The last frame if it has become a keyframe: the mapper has added landmarks to it since.
const Keyframe* Tracker::LastAsKeyframe(const Map& map) const {
  return last_->frame.index == newest_keyframe_frame_ ? map.keyframes.Find(newest_keyframe_)
                                                      : nullptr;
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

TrackReport Tracker::Follow(const Frame& frame, const Map& map) {
  const std::optional<Rigid3> reference = last_ ? map.ResolvePose(last_->reference) : std::nullopt;
  if (!reference) return {};
  const Rigid3 last_pose = last_->cam_from_reference * *reference;
  if (const Keyframe* keyframe = LastAsKeyframe(map)) last_->landmarks = keyframe->landmarks;
  const TrackDemands demands = Demands(frame);
  const Features& before = *last_->frame.features;
  const auto in_local_map = [&](const TrackReport& first) {
    return StrengthenedInLocalMap(frame, map, first, demands);
  };
  const double window =
      motion_ ? std::max(kMotionWindow, kErrorsSearched * motion_->error) : kMotionWindow;
  const Rigid3 predicted = Predict(last_pose, frame.timestamp);
  for (const double radius : {window, 2 * window, 4 * window})
    if (const TrackReport found = in_local_map(
            TrackFromLastFrame(frame, map, before, last_->landmarks, predicted, radius));
        found.success)
      return found;
  if (motion_)
    if (const TrackReport found = in_local_map(
            TrackFromLastFrame(frame, map, before, last_->landmarks, last_pose, 2 * window));
        found.success)
      return found;
  if (const TrackReport found =
          in_local_map(TrackByDescriptors(frame, map, before, last_->landmarks, rng_));
      found.success)
    return found;
  const Keyframe* keyframe = map.keyframes.Find(last_->reference);
  if (keyframe)
    if (const TrackReport found = in_local_map(
            TrackByDescriptors(frame, map, *keyframe->features, keyframe->landmarks, rng_));
        found.success)
      return found;
  return {};
}

void Tracker::Remember(const Frame& frame, const Map& map, const TrackReport& tracked,
                       TrackingState state) {
  const Rigid3 cam_from_reference = RelativeTo(map, tracked.reference, tracked.cam_from_world);
  const auto before = last_ ? map.ResolvePose(last_->reference) : std::nullopt;
  if (before && frame.timestamp != last_->frame.timestamp) {
    const Rigid3 last_pose = last_->cam_from_reference * *before;
    const double error = PredictionError(frame, map, tracked, Predict(last_pose, frame.timestamp));
    motion_ = Motion{tracked.cam_from_world * last_pose.Inverse(),
                     frame.timestamp - last_->frame.timestamp, error};
  } else {
    motion_.reset();
  }
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
