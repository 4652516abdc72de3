#include "oaslam/system/tracker.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "oaslam/tracking/keyframe_decision.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {

Tracker::Outcome Tracker::Outcome::Tracked(TrackingState state, const Rigid3& cam_from_world,
                                           int matched, int inliers) {
  Outcome outcome;
  outcome.state = state;
  outcome.cam_from_world = cam_from_world;
  outcome.matched = matched;
  outcome.inliers = inliers;
  return outcome;
}

Tracker::Tracker(const SlamConfig& config, const NextIds& ids, bool map_is_loaded)
    : config_(config),
      initializer_(config.tracking),
      relocalizer_(config),
      rng_(static_cast<uint64_t>(config.runner.seed)),
      phase_(map_is_loaded ? Phase::kLost : Phase::kInitializing),
      map_is_loaded_(map_is_loaded),
      next_keyframe_(ids.keyframe),
      object_tracks_{{}, ids.object, {}} {}

Tracker::Outcome Tracker::PassOver(const Frame& frame, const Map& map) {
  Take(frame);
  return Lose(frame, map);
}

void Tracker::Take(const Frame& frame) {
  // Frames of some 50 KB; 4 s at 30 Hz, which bounds the memory. The newest keep their image.
  constexpr size_t kMaxUndetected = 120, kWithImage = 30;
  if (frame.detections_follow) undetected_.push_back({frame, {}, {}, {}, {}, 0});
  if (undetected_.size() > kMaxUndetected) undetected_.pop_front();
  if (undetected_.size() > kWithImage)
    undetected_[undetected_.size() - 1 - kWithImage].frame.image.reset();
  newest_ = {};
  newest_.frame = frame;
  if (frame.motion && frame.motion->is_keyframe) view_has_changed_ = true;
}

Tracker::Outcome Tracker::Track(const Frame& frame, const Map& map) {
  Take(frame);
  if (phase_ == Phase::kInitializing) return Initialize(frame, map);
  if (phase_ == Phase::kLost) return Relocalize(frame, map);
  const auto predicted = PredictByOdometry(frame, map);
  if (predicted && frame.features->size() == 0) return Carry(frame, map, *predicted);
  const TrackReport tracked =
      predicted ? FollowByOdometry(frame, map, *predicted) : FollowWithoutMotion(frame, map);
  if (tracked.success) return Continue(frame, map, tracked, TrackingState::kTracking);
  if (predicted && !mapping_)
    if (auto found = RegisterAgain(frame, map)) return *std::move(found);
  if (predicted) return Continue(frame, map, tracked, TrackingState::kOdometry);
  const auto keyframes = static_cast<int>(map.keyframes.size() + map.retired.size());
  const bool is_wanted = map_is_loaded_ || !map.anchors.empty() || map.is_metric;
  if (!mapping_ || is_wanted || keyframes >= config_.tracking.reset_below_keyframes)
    return Relocalize(frame, map);
  phase_ = Phase::kLost;
  Outcome outcome;
  outcome.state = TrackingState::kInitializing;
  outcome.gives_up = true;
  return outcome;
}

Tracker::Outcome Tracker::Lose(const Frame& frame, const Map& map) {
  KeepLost(frame);
  return ByRegistration(frame, map);
}

Tracker::Outcome Tracker::Continue(const Frame& frame, const Map& map, const TrackReport& tracked,
                                   TrackingState state) {
  Remember(frame, map, tracked, state);
  is_pose_doubted_ = false;
  Outcome outcome = OutcomeOf(frame, map, tracked, state);
  ObserveObjects(frame, map, tracked, outcome);
  if (state != TrackingState::kOdometry && !another_grows_) FillInLost(frame, map, tracked);
  if (another_grows_)
    outcome.located = TrackedAt(tracked.cam_from_world, map.MedianDepth(tracked.reference));
  if (!mapping_) {
    TakeRest();
    if (state != TrackingState::kOdometry)
      AddToRegistration(frame, map, TrackedAt(tracked.cam_from_world, tracked.depth));
  } else if (state != TrackingState::kRelocalized && !another_grows_) {  // not while in doubt
    MakeKeyframe(frame, map, tracked, outcome);
  }
  return outcome;
}

Tracker::Outcome Tracker::Initialize(const Frame& frame, const Map& map) {
  if (!mapping_) return WithoutMap(nullptr);
  Outcome outcome = WithoutMap(frame.motion.get());
  std::optional<InitialMap> initial = initializer_.Process(frame, map.cameras[frame.camera]);
  if (!initial) return outcome;
  initial->first_id = KeyframeId(next_keyframe_++);
  initial->second_id = KeyframeId(next_keyframe_++);
  trajectory_.Clear();
  for (const auto& [pose_frame, id] :
       {std::pair{initial->first, initial->first_id}, std::pair{frame, initial->second_id}})
    trajectory_.Add({pose_frame.index, pose_frame.timestamp, id, {}, TrackingState::kTracking},
                    pose_frame, {});
  newest_keyframe_ = initial->second_id;
  newest_keyframe_time_ = frame.timestamp;
  outcome.command = MapCommand{frame.index, *std::move(initial)};
  outcome.map_required = true;
  return outcome;
}

Tracker::Outcome Tracker::AdoptInitialMap(const Frame& frame, const Map& map) {
  const std::vector<Frame> before = initializer_.Reset();
  const Keyframe* keyframe = map.keyframes.Find(newest_keyframe_);
  if (!keyframe) {
    trajectory_.Clear();
    return WithoutMap(frame.motion.get());
  }
  phase_ = Phase::kTracking;
  uses_.clear();
  last_ = Last{frame, keyframe->landmarks, newest_keyframe_, {}, PoseCovariance::Zero()};
  newest_.landmarks = keyframe->landmarks;
  anchors_ = {{frame.motion, newest_keyframe_, {}}};
  seen_in_map_time_ = map_began_time_ = frame.timestamp;
  depth_ = map.MedianDepth(newest_keyframe_);
  unit_ = OdometryUnit{frame.motion->run, 0, 1, kUnitSeconds};
  keyframe_motions_ = {{newest_keyframe_, frame.motion}};
  FillInBeforeMap(before, map);
  newest_keyframe_inliers_ = static_cast<int>(map.landmarks.size());
  drift_ = {};
  parting_ = {};
  seen_confidence_ = 0;
  TrackReport tracked;
  tracked.cam_from_world = keyframe->cam_from_world;
  tracked.reference = newest_keyframe_;
  tracked.matched = tracked.inliers = newest_keyframe_inliers_;
  tracked.depth = depth_;
  return OutcomeOf(frame, map, tracked, TrackingState::kTracking);
}

Relocalization Tracker::Find(const Frame& frame, const Map& map) {
  newest_.relocalization = relocalizer_.Find(frame, map, relocalization_mode_, rng_,
                                             mapping_ ? nullptr : &object_trails_, prior_);
  return *newest_.relocalization;
}

Tracker::Outcome Tracker::Relocalize(const Frame& frame, const Map& map) {
  phase_ = Phase::kLost;
  last_.reset();
  seen_confidence_ = 0;
  return PlaceLost(frame, map, Find(frame, map));
}

Tracker::Outcome Tracker::PlaceLost(const Frame& frame, const Map& map,
                                    const Relocalization& found) {
  if (!found.IsFound()) return Lose(frame, map);
  if (found.evidence == PoseEvidence::kObjects) return ReportObjectPose(frame, map, found);
  const TrackReport tracked = TrackFound(frame, map, found);
  if (!tracked.success)
    return found.objects.suffices && !mapping_ ? ReportObjectPose(frame, map, found)
                                               : Lose(frame, map);
  prior_.reset();
  return Continue(frame, map, tracked, TrackingState::kRelocalized);
}

// Confirms a pose that was found by points in the local map.
TrackReport Tracker::TrackFound(const Frame& frame, const Map& map,
                                const Relocalization& found) const {
  constexpr double kWiderSearch = 2;  // the error of a pose by relocalization
  TrackReport first;
  first.success = true;
  first.cam_from_world = found.cam_from_world;
  first.landmarks = found.points.landmarks;
  first.inliers = found.points.inliers;
  constexpr double kAgreement = 0.225;  // docs/lab/tracking.md
  TrackDemands demands = Demands();
  demands.inliers = demands.least_inliers = config_.tracking.min_relocalization_inliers;
  demands.agreement = kAgreement;
  demands.radius_scale = kWiderSearch;
  TrackReport tracked = TrackLocalMap(frame, map, first, demands);
  if (!tracked.success || is_pose_doubted_) return tracked;
  // The camera must be able to have moved there from its last pose.
  const FramePose here{frame.index, frame.timestamp, tracked.reference,
                       RelativeTo(map, tracked.reference, tracked.cam_from_world),
                       TrackingState::kRelocalized};
  tracked.success = IsContinuous(map, NewestPoses(trajectory_.poses(), frame.timestamp), map,
                                 {&here, 1}, Similarity());
  return tracked;
}

void Tracker::Adopt(const Piece& piece, double scale) {
  trajectory_.Adopt(piece.trajectory, scale);
  const NextIds next = NextIdsOf(piece.map);
  next_keyframe_ = std::max(next_keyframe_, next.keyframe);
  object_tracks_.next_object = std::max(object_tracks_.next_object, next.object);
}

void Tracker::GoOnAs(Tracker other, double scale) {
  other.Scale(scale);
  // These belong to this map.
  trajectory_.Join(std::move(other.trajectory_));
  other.trajectory_ = std::move(trajectory_);
  other.sightings_.insert(other.sightings_.begin(), sightings_.begin(), sightings_.end());
  other.relocalizer_ = std::move(relocalizer_);
  other.newest_.relocalization = newest_.relocalization;
  other.rng_ = rng_;
  other.map_is_loaded_ = map_is_loaded_;
  other.lost_images_.clear();
  other.drift_ = {};
  other.parting_ = {};
  *this = std::move(other);
}

void Tracker::Scale(double factor) {
  if (last_) last_->cam_from_reference.translation *= factor;
  if (prior_) prior_->translation *= factor;
  for (OdometryAnchor& anchor : anchors_) anchor.cam_from_reference.translation *= factor;
  if (unit_) unit_->length *= factor;
  depth_ *= factor;
  registration_ = {};
  object_trails_ = {};
  for (ObjectTrack& track : object_tracks_.open) track.cam_from_reference.translation *= factor;
  for (TrackedFrame& undetected : undetected_) undetected.cam_from_reference.translation *= factor;
  for (ObjectSighting& sighting : sightings_)
    sighting.observation.cam_from_reference.translation *= factor;
  trajectory_.Scale(factor);
}

FrameView Tracker::View() const {
  FrameView view = newest_;
  const std::vector<ObjectDetection>& detections = newest_.frame.detections;
  view.detected.resize(detections.size());
  for (const ObjectTrack& track : object_tracks_.open)
    for (size_t i = 0; track.last_frame == newest_.frame.index && i < detections.size(); ++i)
      if (detections[i].box == track.last_box && detections[i].category_id == track.category_id)
        view.detected[i] = track.object;
  if (const FramePose* pose = trajectory_.PoseOf(newest_.frame.index)) view.pose = *pose;
  return view;
}

void Tracker::ForceRelocalization(const std::optional<Rigid3>& near) {
  object_trails_ = {};
  registration_ = {};
  prior_ = near;
  if (phase_ != Phase::kTracking) return;
  phase_ = Phase::kLost;
  last_.reset();
  is_pose_doubted_ = true;
}

Tracker::Outcome Tracker::Present(const Map& map) {
  const auto reference = last_ ? map.ResolveKeyframe(last_->reference) : std::nullopt;
  if (!reference || phase_ != Phase::kTracking) return {};
  TrackReport tracked;
  tracked.cam_from_world = last_->cam_from_reference * *map.ResolvePose(last_->reference);
  tracked.reference = reference->by;
  tracked.matched = tracked.inliers = static_cast<int>(
      std::ranges::count_if(last_->landmarks, [](LandmarkId id) { return id.IsValid(); }));
  tracked.depth = map.MedianDepth(reference->by);
  tracked.covariance = last_->covariance;
  return OutcomeOf(last_->frame, map, tracked, TrackingState::kRelocalized);
}

void Tracker::MakeKeyframe(const Frame& frame, const Map& map, const TrackReport& tracked,
                           Outcome& outcome) {
  KeyframeEvidence evidence{
      .seconds_since_keyframe = std::abs(frame.timestamp - newest_keyframe_time_),
      .mapper_idle = !newest_keyframe_.IsValid() || map.keyframes.Contains(newest_keyframe_) ||
                     map.retired.Contains(newest_keyframe_),
      .matched = tracked.matched,
      .inliers = tracked.inliers,
      .reference_landmarks =
          map.CountTrackedLandmarks(tracked.reference, map.keyframes.size() > 2 ? 3 : 2),
      .inliers_at_keyframe = newest_keyframe_inliers_};
  if (outcome.state == TrackingState::kOdometry) {
    const auto motion = keyframe_motions_.empty()
                            ? std::nullopt
                            : MotionSince(keyframe_motions_.back().second, frame);
    evidence.view_has_changed = view_has_changed_ && motion && !motion->is_turn;
  }
  const KeyframeNeed need = NeedsKeyframe(evidence, config_.tracking);
  if (need == KeyframeNeed::kNone) return;
  view_has_changed_ = false;
  anchors_.push_back({frame.motion, KeyframeId(next_keyframe_), {}});
  newest_keyframe_ = KeyframeId(next_keyframe_++);
  newest_keyframe_time_ = frame.timestamp;
  constexpr size_t kMostMotions = 30;  // the odometry's window mostly has fewer of these keyframes
  keyframe_motions_.emplace_back(newest_keyframe_, frame.motion);
  if (keyframe_motions_.size() > kMostMotions) keyframe_motions_.erase(keyframe_motions_.begin());
  newest_keyframe_inliers_ = tracked.inliers;
  trajectory_.MakeKeyframe(frame.index, newest_keyframe_);
  outcome.command = TakeRest();
  outcome.command->edit = KeyframeInsertion{newest_keyframe_, Placed(frame, map, tracked),
                                            MotionsToKeyframes(frame), map.loops_closed};
  outcome.is_keyframe = true;
  outcome.is_urgent = need == KeyframeNeed::kUrgent;
}

TrackedFrame Tracker::Placed(const Frame& frame, const Map& map, const TrackReport& tracked) {
  return {frame,
          tracked.cam_from_world,
          tracked.reference,
          RelativeTo(map, tracked.reference, tracked.cam_from_world),
          tracked.landmarks,
          tracked.inliers};
}

MapCommand Tracker::TakeRest() {
  std::ranges::stable_sort(uses_, {}, &LandmarkUse::landmark);
  std::vector<LandmarkUse> sums;
  for (const LandmarkUse& use : std::exchange(uses_, {})) {
    if (sums.empty() || sums.back().landmark != use.landmark) sums.push_back({use.landmark, 0, 0});
    sums.back().visible += use.visible;
    sums.back().found += use.found;
  }
  return {newest_.frame.index, {}, std::move(sums), std::exchange(sightings_, {})};
}

void Tracker::ObserveObjects(const Frame& frame, const Map& map, const TrackReport& tracked,
                             Outcome& outcome) {
  const Stopwatch watch;
  if (frame.detections_follow)
    undetected_.back() = Placed(frame, map, tracked);
  else
    outcome.objects = Associate(Placed(frame, map, tracked), map);
  outcome.ms_objects = watch.WallMs();
}

// Associates the detections with objects; returns how many mapped objects were seen.
int Tracker::Associate(const TrackedFrame& seen, const Map& map) {
  ObjectAssociation association =
      AssociateObjects(seen, map, std::move(object_tracks_), config_.objects);
  object_tracks_ = std::move(association.tracks);
  int objects = 0;
  for (ObjectSighting& sighting : association.sightings) {
    const auto now = map.ResolveObject(sighting.object);
    objects += sighting.detected && now && map.objects.At(*now).state == ObjectState::kMapped;
    sightings_.push_back(std::move(sighting));
  }
  return objects;
}

std::optional<Tracker::Outcome> Tracker::AddDetections(int frame_index,
                                                       std::vector<ObjectDetection> detections,
                                                       const Map& map) {
  const auto found = std::ranges::find(undetected_, frame_index,
                                       [](const TrackedFrame& u) { return u.frame.index; });
  if (found == undetected_.end()) return std::nullopt;
  TrackedFrame late = std::move(*found);
  undetected_.erase(undetected_.begin(), found + 1);
  late.frame.detections = std::move(detections);
  late.frame.detections_follow = false;
  if (!late.reference.IsValid()) {
    if (phase_ != Phase::kLost || late.frame.timestamp <= seen_in_map_time_) return std::nullopt;
    return PlaceLost(late.frame, map,
                     relocalizer_.Find(late.frame, map, relocalization_mode_, rng_));
  }
  const auto reference = map.ResolvePose(late.reference);
  if (!reference) return std::nullopt;
  late.cam_from_world = late.cam_from_reference * *reference;
  Outcome outcome =
      Outcome::Tracked(TrackingState::kTracking, late.cam_from_world, 0, late.inliers);
  outcome.objects = Associate(late, map);
  return outcome;
}

}  // namespace oaslam
