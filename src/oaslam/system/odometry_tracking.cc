// What the tracker makes of the odometry: a prediction, a pose where the map gives none, and the
// length of its unit in the map.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>
#include <utility>
#include <vector>

#include "oaslam/geometry/pose_step.h"
#include "oaslam/map/motion_sigmas.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/system/tracker.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr double kYoung = 2;  // seconds, of a map

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
  const auto x_of = [](const FrameMotion::KnownDepth& d) { return d.px.x(); };
  std::vector<FrameMotion::KnownDepth> depths = frame.motion->depths;
  std::ranges::stable_sort(depths, {}, x_of);
  std::vector<double> lengths;
  for (size_t i = 0; i < tracked.landmarks.size(); ++i) {
    const Landmark* landmark = map.landmarks.Find(tracked.landmarks[i]);
    if (!landmark) continue;
    const Eigen::Vector2f& px = frame.features->keypoints[i].px;
    const auto distance = [&](const auto& d) { return (d.px - px).squaredNorm(); };
    const auto near =
        std::ranges::subrange(std::ranges::lower_bound(depths, px.x() - radius, {}, x_of),
                              std::ranges::upper_bound(depths, px.x() + radius, {}, x_of));
    const auto beside = std::ranges::min_element(near, {}, distance);
    if (beside == near.end() || distance(*beside) > radius * radius) continue;
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

}  // namespace

// The motion between two images in the unit of the map, and how far to trust it. While the odometry
// does not know how far the camera has moved, it still knows how it has turned.
std::optional<Tracker::CameraMotion> Tracker::MotionBetween(
    const std::shared_ptr<const FrameMotion>& before, const std::shared_ptr<const FrameMotion>& now,
    const FrameMotion& newest) const {
  if (!before || !now || before->run != now->run || newest.run != now->run) return std::nullopt;
  const bool is_young = newest_.frame.timestamp - map_began_time_ < kYoung;
  CameraMotion motion;
  motion.cam_from_cam = CamFromOdom(*now, newest).value_or(now->cam_from_odom) *
                        CamFromOdom(*before, newest).value_or(before->cam_from_odom).Inverse();
  motion.is_turn = !HaveKnownMotion(before, now) || !unit_ || unit_->run != now->run;
  if (motion.is_turn) {
    motion.cam_from_cam.translation.setZero();
    motion.sigma_position = kUnknownWay * depth_;
  } else {
    motion.cam_from_cam.translation *= unit_->length;
    motion.sigma_position =
        std::max(kSigmaOfWay, unit_->spread) * motion.cam_from_cam.translation.norm() +
        (is_young ? kSigmaOfDepthIfYoung : kSigmaOfDepth) * unit_->length * MedianDepth(*now);
  }
  // A way that is not known looks like a turn.
  const double least_turn = motion.is_turn ? kUnknownWay : kLeastTurn;
  motion.sigma_rotation =
      kSigmaOfTurn * Eigen::AngleAxisd(Eigen::Quaterniond(motion.cam_from_cam.rotation)).angle() +
      least_turn;
  return motion;
}

std::optional<Tracker::CameraMotion> Tracker::MotionSince(
    const std::shared_ptr<const FrameMotion>& before, const Frame& frame) const {
  return frame.motion ? MotionBetween(before, frame.motion, *frame.motion) : std::nullopt;
}

// The motion to the newest keyframe, and those before it that lie in the odometry's window, as the
// odometry knows them by now. It goes on correcting them: otherwise the chain of motions would keep
// its errors.
std::vector<std::pair<KeyframeId, KeyframeMotion>> Tracker::MotionsToKeyframes(
    const Frame& frame) const {
  std::vector<std::pair<KeyframeId, KeyframeMotion>> motions;
  for (size_t i = 1; i < keyframe_motions_.size(); ++i) {
    const auto& [from, before] = keyframe_motions_[i - 1];
    const auto& [to, now] = keyframe_motions_[i];
    const bool is_newest = i + 1 == keyframe_motions_.size();
    if (!before || !frame.motion || (!is_newest && !CamFromOdom(*before, *frame.motion))) continue;
    const auto motion = MotionBetween(before, now, *frame.motion);
    if (motion && !motion->is_turn)
      motions.push_back({to, KeyframeMotion{from, motion->cam_from_cam, motion->sigma_position,
                                            motion->sigma_rotation}});
  }
  return motions;
}

// The pose by the camera's motion since the newest anchor that is in the map.
std::optional<OdometryPrediction> Tracker::PredictByOdometry(const Frame& frame,
                                                             const Map& map) const {
  for (const OdometryAnchor& anchor : anchors_ | std::views::reverse) {
    const auto carried = map.ResolveKeyframe(anchor.reference);
    const auto motion = carried ? MotionSince(anchor.motion, frame) : std::nullopt;
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

bool Tracker::NeedsFeatures(double timestamp, const FrameMotion* motion) const {
  // Two images at 30 Hz may pass in between. Other values were not measured.
  constexpr double kSeconds = 0.08;
  // A new map needs all the keyframes that it can get (docs/lab/odometry.md).
  if (phase_ != Phase::kTracking || !last_ || !unit_ ||
      timestamp - last_->frame.timestamp > kSeconds || timestamp - map_began_time_ < kYoung)
    return true;
  return motion && (motion->is_preliminary || motion->is_keyframe || motion->run != unit_->run);
}

// Goes on by the motion since the last frame, without having looked for the map: its landmarks are
// shown where they must be.
Tracker::Outcome Tracker::Carry(const Frame& frame, const Map& map,
                                const OdometryPrediction& predicted) {
  TrackReport carried;
  carried.cam_from_world = predicted.expected.cam_from_world;
  carried.reference = predicted.reference;
  carried.covariance = predicted.expected.Covariance();
  Features features = *frame.features;
  const Features& before = *last_->frame.features;
  for (size_t i = 0; i < last_->landmarks.size(); ++i) {
    const LandmarkId id = last_->landmarks[i];
    const Landmark* landmark = map.landmarks.Find(id);
    const auto seen = landmark ? ProjectLandmark(id, *landmark, map.cameras[frame.camera],
                                                 carried.cam_from_world, before)
                               : std::nullopt;
    if (!seen) continue;
    features.keypoints.push_back(before.keypoints[i]);
    features.keypoints.back().px = seen->px.cast<float>();
    features.descriptors.push_back(before.descriptors[i]);
    carried.landmarks.push_back(id);
  }
  carried.matched = carried.inliers = features.size();
  carried.depth = depth_;
  newest_.frame.features = std::make_shared<const Features>(std::move(features));
  newest_.landmarks = carried.landmarks;
  constexpr double kSeconds = 0.2;  // since the map was seen
  Outcome outcome =
      OutcomeOf(frame, map, carried,
                frame.timestamp - seen_in_map_time_ < kSeconds ? TrackingState::kTracking
                                                               : TrackingState::kOdometry);
  ObserveObjects(newest_.frame, map, carried, outcome);
  if (!mapping_) TakeRest();
  const FramePose pose{frame.index, frame.timestamp, carried.reference,
                       RelativeTo(map, carried.reference, carried.cam_from_world), outcome.state};
  if (const auto motion = MotionSince(last_->frame.motion, frame))
    trajectory_.AddCarried(pose, last_->frame.index, motion->cam_from_cam);
  else
    trajectory_.Add(pose, frame, {});
  return outcome;
}

// Finds the pose near the one that is predicted. Many landmarks may contradict the prediction, few
// may not. Where it does not succeed, the report has the pose by the prediction and the few
// landmarks that are in view.
TrackReport Tracker::FollowByOdometry(const Frame& frame, const Map& map,
                                      const OdometryPrediction& predicted) {
  constexpr double kSigmas = 5;
  const ExpectedPose& expected = predicted.expected;
  TrackDemands demands = Demands();
  // After images of which only the turn was known, the map is found again as by a relocalization.
  if (predicted.is_turn && last_->frame.timestamp != seen_in_map_time_)
    demands.inliers = demands.least_inliers = config_.tracking.min_relocalization_inliers;
  const auto agrees = [&](const TrackReport& report) {
    const PoseVector off = StepOf(report.cam_from_world * expected.cam_from_world.Inverse());
    return report.inliers >= kFewLandmarks ||
           (off.head<3>().norm() < kSigmas * expected.sigma_position &&
            off.tail<3>().norm() < kSigmas * expected.sigma_rotation);
  };
  for (const double radius : {kMotionWindow, 3 * kMotionWindow}) {
    const TrackReport report = StrengthenedInLocalMap(
        frame, map,
        TrackFromLastFrame(frame, map, *last_->frame.features, last_->landmarks,
                           expected.cam_from_world, radius),
        demands);
    if (report.success && agrees(report)) return report;
  }
  TrackReport report =
      TrackByPrior(frame, map, expected, LandmarksBefore(map, predicted.reference), demands);
  report.success = report.success && agrees(report);
  if (report.success) return report;
  report.reference = predicted.reference;
  if (!(report.depth > 0)) report.depth = unit_ ? unit_->length * MedianDepth(*frame.motion) : 0;
  return report;
}

// The unit of the odometry, by points whose depth it knows that are landmarks of the map, too.
void Tracker::LearnUnit(const Frame& frame, const Map& map, const TrackReport& tracked) {
  const auto length = frame.motion ? UnitOfOdometry(frame, map, tracked) : std::nullopt;
  if (!length) return;
  if (!last_ || !unit_ || unit_->run != frame.motion->run || unit_->loops != map.loops_closed) {
    unit_ = OdometryUnit{frame.motion->run, map.loops_closed, *length};
    return;
  }
  const double elapsed = std::abs(frame.timestamp - last_->frame.timestamp);
  unit_->seconds = std::min(kUnitSeconds, unit_->seconds + elapsed);
  if (unit_->seconds <= 0) return;
  const double off = std::log(*length / unit_->length);
  unit_->length *= std::exp(off * std::min(1.0, elapsed / unit_->seconds));
  unit_->spread_seconds = std::min(kUnitSeconds, unit_->spread_seconds + elapsed);
  unit_->spread += (std::abs(off) - unit_->spread) * std::min(1.0, elapsed / unit_->spread_seconds);
}

// Without mapping nothing but this corrects a pose that the odometry carries on: the frame is
// looked for in the whole map, from time to time, since that takes more time than tracking.
std::optional<Tracker::Outcome> Tracker::RegisterAgain(const Frame& frame, const Map& map) {
  constexpr double kSeconds = 0.2;
  if (std::abs(frame.timestamp - looked_in_map_time_) < kSeconds) return std::nullopt;
  looked_in_map_time_ = frame.timestamp;
  const Relocalization found = Find(frame, map);
  if (found.evidence == PoseEvidence::kNone || found.evidence == PoseEvidence::kObjects)
    return std::nullopt;
  const TrackReport tracked = TrackFound(frame, map, found);
  if (!tracked.success) return std::nullopt;
  return Continue(frame, map, tracked, TrackingState::kRelocalized);
}

}  // namespace oaslam
