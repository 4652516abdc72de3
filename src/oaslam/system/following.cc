#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>
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

// The median depth of the points that the odometry follows, in its unit; 0 without any.
double MedianDepth(const FrameMotion& motion) {
  std::vector<double> inverse;
  for (const FrameMotion::KnownDepth& d : motion.depths) inverse.push_back(d.inverse_depth);
  return inverse.empty() ? 0 : 1 / Median(std::move(inverse));
}

// The length of the odometry's unit in units of the map: by key points with a landmark that lie
// beside a point whose depth the odometry knows.
std::optional<double> UnitOfOdometry(const Frame& frame, const Map& map,
                                     const TrackReport& tracked) {
  constexpr double kBeside = 3;  // pixels of the lowest level: mostly the same corner
  constexpr size_t kLeast = 10;
  const double radius = kBeside * frame.features->pyramid.working_pixel();
  std::vector<double> lengths;
  for (size_t i = 0; i < tracked.landmarks.size(); ++i) {
    const Landmark* landmark =
        tracked.landmarks[i].IsValid() ? map.landmarks.Find(tracked.landmarks[i]) : nullptr;
    if (!landmark) continue;
    const Eigen::Vector2f& px = frame.features->keypoints[i].px;
    const auto distance = [&](const auto& d) { return (d.px - px).squaredNorm(); };
    const auto beside = std::ranges::min_element(frame.motion->depths, {}, distance);
    if (beside == frame.motion->depths.end() || distance(*beside) > radius * radius) continue;
    lengths.push_back((tracked.cam_from_world * landmark->position).z() *
                      static_cast<double>(beside->inverse_depth));
  }
  if (lengths.size() < kLeast) return std::nullopt;
  const double length = Median(std::move(lengths));
  return length > 0 ? std::optional(length) : std::nullopt;
}

// What a keyframe saw; where that is little, also what those before it saw.
std::vector<LandmarkId> LandmarksBefore(const Map& map, KeyframeId id) {
  constexpr int kMostKeyframes = 20;  // some seconds
  std::vector<LandmarkId> landmarks;
  for (int i = 0; i < kMostKeyframes && landmarks.size() < Tracker::kFewLandmarks; ++i) {
    const Keyframe& keyframe = map.keyframes.At(id);
    std::ranges::copy_if(keyframe.landmarks, std::back_inserter(landmarks),
                         [](LandmarkId landmark) { return landmark.IsValid(); });
    const auto before = keyframe.motion ? map.ResolveKeyframe(keyframe.motion->from) : std::nullopt;
    if (!before) break;
    id = before->by;
  }
  return landmarks;
}

constexpr double kProbation = 0.5;     // seconds, in which a false pose should fail
constexpr double kMotionWindow = 15;   // smallest search radius, pixels of the lowest level
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
  if (IsOnProbation(frame))
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

bool Tracker::IsOnProbation(const Frame& frame) const {
  return relocalized_frame_ && frame.timestamp - relocalized_time_ <= kProbation;
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

// The motion between two images in the unit of the map, and how far to trust it. While the odometry
// does not know how far the camera has moved, it still knows how it has turned.
std::optional<Tracker::CameraMotion> Tracker::MotionBetween(
    const std::shared_ptr<const FrameMotion>& before,
    const std::shared_ptr<const FrameMotion>& now) const {
  // Shares of the way, of the depth and of the turn; the errors of the odometry over a second are
  // about half of these (docs/lab/odometry.md). The last is a guess: a hand's way in a tenth of a
  // second.
  constexpr double kSigmaOfWay = 0.05, kSigmaOfDepth = 0.005, kSigmaOfTurn = 0.02,
                   kLeastTurn = 0.004, kUnknownWay = 0.03;
  if (!before || !now || before->run != now->run) return std::nullopt;
  CameraMotion motion;
  motion.cam_from_cam = now->cam_from_odom * before->cam_from_odom.Inverse();
  motion.is_turn =
      before->is_preliminary || now->is_preliminary || !unit_ || unit_->run != now->run;
  if (motion.is_turn) {
    motion.cam_from_cam.translation.setZero();
    motion.sigma_position = kUnknownWay * depth_;
  } else {
    motion.cam_from_cam.translation *= unit_->length;
    motion.sigma_position = kSigmaOfWay * motion.cam_from_cam.translation.norm() +
                            kSigmaOfDepth * unit_->length * MedianDepth(*now);
  }
  // A way that is not known looks like a turn.
  const double least_turn = motion.is_turn ? kUnknownWay : kLeastTurn;
  motion.sigma_rotation =
      kSigmaOfTurn * Eigen::AngleAxisd(Eigen::Quaterniond(motion.cam_from_cam.rotation)).angle() +
      least_turn;
  return motion;
}

std::optional<KeyframeMotion> Tracker::MotionSinceKeyframe(const Frame& frame) const {
  const auto motion = MotionBetween(keyframe_motion_, frame.motion);
  if (!motion || motion->is_turn) return std::nullopt;
  return KeyframeMotion{newest_keyframe_, motion->cam_from_cam, motion->sigma_position,
                        motion->sigma_rotation};
}

// The pose by the camera's motion since the newest anchor that is in the map.
std::optional<OdometryPrediction> Tracker::PredictByOdometry(const Frame& frame,
                                                             const Map& map) const {
  for (const OdometryAnchor& anchor : anchors_ | std::views::reverse) {
    const auto carried = map.ResolveKeyframe(anchor.reference);
    const auto motion = carried ? MotionBetween(anchor.motion, frame.motion) : std::nullopt;
    const double seconds = std::abs(frame.timestamp - seen_in_map_time_);
    // Seconds without knowing how far the camera has moved; and without mapping, where the error
    // grows until the map is found again.
    constexpr double kMaxTurning = 1, kMaxUnmapped = 5;
    if (!motion || (motion->is_turn && seconds > kMaxTurning) ||
        (!mapping_ && seconds > kMaxUnmapped))
      continue;
    return OdometryPrediction{
        {motion->cam_from_cam * anchor.cam_from_reference * carried->cam_from_carrier *
             map.keyframes.At(carried->by).cam_from_world,
         (1 + seconds) * motion->sigma_position, (1 + seconds) * motion->sigma_rotation},
        carried->by,
        motion->is_turn};
  }
  return std::nullopt;
}

// Finds the pose near the one that is predicted. Many landmarks may contradict the prediction, few
// may not. Where it does not succeed, the report has the pose by the prediction and the few
// landmarks that are in view.
TrackReport Tracker::FollowByOdometry(const Frame& frame, const Map& map,
                                      const OdometryPrediction& predicted) {
  constexpr double kSigmas = 5;
  const ExpectedPose& expected = predicted.expected;
  TrackDemands demands = Demands(frame);
  // After images of which only the turn was known, the map is found again as by a relocalization.
  if (predicted.is_turn && last_->frame.timestamp != seen_in_map_time_)
    demands.inliers = demands.least_inliers = config_.tracking.min_relocalization_inliers;
  const auto agrees = [&](const TrackReport& report) {
    const Rigid3 off = report.cam_from_world * expected.cam_from_world.Inverse();
    return report.inliers >= kFewLandmarks ||
           (off.translation.norm() < kSigmas * expected.sigma_position &&
            Eigen::AngleAxisd(Eigen::Quaterniond(off.rotation)).angle() <
                kSigmas * expected.sigma_rotation);
  };
  for (const double radius : {kMotionWindow, 3 * kMotionWindow}) {
    const TrackReport report = StrengthenedInLocalMap(
        frame, map,
        TrackFromLastFrame(frame, map, *last_->frame.features, last_->landmarks,
                           expected.cam_from_world, radius),
        demands);
    if (report.success && agrees(report)) return report;
  }
  if (predicted.is_turn)
    if (const TrackReport report = Follow(frame, map); report.success) return report;
  TrackReport report =
      TrackByPrior(frame, map, expected, LandmarksBefore(map, predicted.reference), demands);
  report.success = report.success && agrees(report);
  return report;
}

// Goes on with a pose by the camera's motion; the map gave none.
Tracker::Outcome Tracker::ContinueByOdometry(const Frame& frame, const Map& map,
                                             const OdometryPrediction& predicted,
                                             TrackReport carried) {
  carried.reference = predicted.reference;
  if (!(carried.depth > 0)) carried.depth = unit_ ? unit_->length * MedianDepth(*frame.motion) : 0;
  return Continue(frame, map, carried, TrackingState::kOdometry);
}

// The unit of the odometry, by points whose depth it knows that are landmarks of the map, too.
void Tracker::LearnUnit(const Frame& frame, const Map& map, const TrackReport& tracked) {
  constexpr double kSeconds = 3;  // time constant: the odometry's scale drifts slowly
  if (!frame.motion) return;
  const std::optional<double> length = UnitOfOdometry(frame, map, tracked);
  if (!length) return;
  const bool goes_on = unit_ && unit_->run == frame.motion->run && last_;
  const double seconds = goes_on ? std::abs(frame.timestamp - last_->frame.timestamp) : 0;
  const double kept = goes_on ? std::exp(-seconds / kSeconds) : 0;
  unit_ = OdometryUnit{frame.motion->run,
                       goes_on ? *length * std::pow(unit_->length / *length, kept) : *length};
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
  last_ = Last{frame, tracked.landmarks, tracked.reference, cam_from_reference};
  trajectory_.Add({frame.index, frame.timestamp, tracked.reference, cam_from_reference, state},
                  frame, tracked.landmarks);
  trajectory_.RefinePosesBefore(map, frame.index - kRefineAfter);
  phase_ = Phase::kTracking;
  for (const LandmarkId id : tracked.visible) uses_.push_back({id, 1, 0});
  for (const LandmarkId id : tracked.landmarks)
    if (id.IsValid()) uses_.push_back({id, 0, 1});
}

}  // namespace oaslam
