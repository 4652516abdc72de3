#include "oaslam/system/tracker.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "oaslam/tracking/keyframe_decision.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

double PositionSigma(const Map& map, const TrackReport& tracked) {
  return kTrackedSigma * map.MedianDepth(tracked.reference);
}

}  // namespace

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
  // Frames of some 50 KB; 4 s at 30 Hz, which bounds the memory.
  constexpr size_t kMaxUndetected = 120;
  if (frame.detections_follow) undetected_.push_back({{frame, {}, {}, {}, {}, 0}, false});
  if (undetected_.size() > kMaxUndetected) undetected_.pop_front();
  newest_ = {frame, {}};
  relocalization_.reset();
  if (frame.motion && frame.motion->is_keyframe) view_has_changed_ = true;
}

Tracker::Outcome Tracker::Track(const Frame& frame, const Map& map) {
  Take(frame);
  if (phase_ == Phase::kInitializing) return Initialize(frame, map);
  if (phase_ == Phase::kLost) return Relocalize(frame, map);
  const auto predicted = PredictByOdometry(frame, map);
  if (predicted && frame.features->size() == 0) return Carry(frame, map, *predicted);
  TrackReport tracked =
      predicted ? FollowByOdometry(frame, map, *predicted) : FollowWithoutMotion(frame, map);
  if (tracked.success) return Continue(frame, map, tracked, TrackingState::kTracking);
  if (predicted && !mapping_)
    if (auto found = RegisterAgain(frame, map)) return *std::move(found);
  if (predicted) return ContinueByOdometry(frame, map, *predicted, std::move(tracked));
  const auto keyframes = static_cast<int>(map.keyframes.size() + map.retired.size());
  const bool is_wanted = map_is_loaded_ || !map.anchors.empty() || map.is_metric;
  if (mapping_ && !is_wanted && keyframes < config_.tracking.reset_below_keyframes) return GiveUp();
  return Relocalize(frame, map);
}

Tracker::Outcome Tracker::GiveUp() {
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
  Outcome outcome =
      Outcome::Tracked(state, tracked.cam_from_world, tracked.matched, tracked.inliers);
  outcome.depth = tracked.depth;
  StateCertainty(frame, map, tracked.covariance, tracked.reference, outcome);
  ObserveObjects(frame, map, tracked, outcome);
  if (state != TrackingState::kOdometry && !IsOnProbation(frame.timestamp))
    FillInLost(frame, map, tracked);
  if (IsOnProbation(frame.timestamp))
    outcome.located = LocatedPose{tracked.cam_from_world, PositionSigma(map, tracked), true};
  if (mapping_) {
    MakeKeyframe(frame, map, tracked, outcome);
  } else {
    TakeRest();
    if (state != TrackingState::kOdometry)
      AddToRegistration(frame, map, {tracked.cam_from_world, kTrackedSigma * tracked.depth, true});
  }
  return outcome;
}

Tracker::Outcome Tracker::Initialize(const Frame& frame, const Map& map) {
  if (!mapping_) return WithoutMap(nullptr);
  Outcome outcome = WithoutMap(frame.motion.get());
  std::optional<InitialMap> initial = initializer_.Process(frame, map.cameras[frame.camera], rng_);
  if (!initial) return outcome;
  before_map_ = initializer_.TakeRecent();
  initializer_.Reset();
  initial->first_id = KeyframeId(next_keyframe_++);
  initial->second_id = KeyframeId(next_keyframe_++);
  trajectory_.Clear();
  for (const auto& [pose_frame, id] :
       {std::pair{initial->first, initial->first_id}, std::pair{frame, initial->second_id}})
    trajectory_.Add({pose_frame.index, pose_frame.timestamp, id, {}, TrackingState::kTracking},
                    pose_frame, {});
  newest_keyframe_ = initial->second_id;
  newest_keyframe_frame_ = frame.index;
  newest_keyframe_time_ = frame.timestamp;
  outcome.command = MapCommand{frame.index, *std::move(initial)};
  outcome.map_required = true;
  return outcome;
}

Tracker::Outcome Tracker::AdoptInitialMap(const Frame& frame, const Map& map) {
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
  unit_.reset();
  if (frame.motion && !frame.motion->is_preliminary)
    unit_ = OdometryUnit{frame.motion->run, 0, 1, kUnitSeconds};
  keyframe_motions_ = {{newest_keyframe_, frame.motion}};
  FillInBeforeMap(map);
  const int points = static_cast<int>(map.landmarks.size());
  newest_keyframe_inliers_ = points;
  Outcome outcome =
      Outcome::Tracked(TrackingState::kTracking, keyframe->cam_from_world, points, points);
  outcome.depth = map.MedianDepth(newest_keyframe_);
  drift_ = {};
  seen_confidence_ = 0;
  StateCertainty(frame, map, PoseCovariance::Zero(), newest_keyframe_, outcome);
  return outcome;
}

Relocalization Tracker::Find(const Frame& frame, const Map& map) {
  Relocalization found = relocalizer_.Find(frame, map, relocalization_mode_, frame.gravity_in_cam,
                                           rng_, mapping_ ? nullptr : &object_trails_, prior_);
  relocalization_ = {found.evidence, found.confidence, found.inliers, found.matched_objects,
                     found.why_not};
  return found;
}

Tracker::Outcome Tracker::Relocalize(const Frame& frame, const Map& map) {
  phase_ = Phase::kLost;
  last_.reset();
  seen_confidence_ = 0;
  const Relocalization found = Find(frame, map);
  if (found.evidence == PoseEvidence::kNone) return Lose(frame, map);
  if (found.evidence == PoseEvidence::kObjects) return ReportObjectPose(frame, map, found);
  const TrackReport tracked = TrackFound(frame, map, found);
  if (!tracked.success && found.objects_suffice && !mapping_)
    return ReportObjectPose(frame, map, found);
  if (!tracked.success) return Lose(frame, map);
  relocalized_frame_ = frame.index;
  relocalized_time_ = frame.timestamp;
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
  first.landmarks = found.landmarks;
  first.inliers = found.inliers;
  constexpr double kAgreement = 0.225;  // docs/lab/tracking.md
  const int inliers = config_.tracking.min_relocalization_inliers;
  TrackReport tracked = TrackLocalMap(frame, map, first,
                                      {.inliers = inliers,
                                       .least_inliers = inliers,
                                       .spread = LeastSpread(),
                                       .agreement = kAgreement,
                                       .radius_scale = kWiderSearch});
  tracked.success = tracked.success && CouldHaveGone(frame, map, tracked);
  return tracked;
}

bool Tracker::CouldHaveGone(const Frame& frame, const Map& map, const TrackReport& tracked) const {
  const FramePose here{frame.index, frame.timestamp, tracked.reference,
                       RelativeTo(map, tracked.reference, tracked.cam_from_world),
                       TrackingState::kRelocalized};
  return is_pose_doubted_ || IsContinuous(map, NewestPoses(trajectory_.poses(), frame.timestamp),
                                          map, {&here, 1}, Similarity());
}

void Tracker::SkipIds(const NextIds& ids) {
  next_keyframe_ = std::max(next_keyframe_, ids.keyframe);
  object_tracks_.next_object = std::max(object_tracks_.next_object, ids.object);
}

FrameView Tracker::View() const {
  FrameView view;
  view.frame = newest_.frame;
  view.relocalization = relocalization_;
  view.landmarks = newest_.landmarks;
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
  const auto reference = last_ ? map.ResolvePose(last_->reference) : std::nullopt;
  if (!reference || phase_ != Phase::kTracking) return {};
  const auto seen = static_cast<int>(
      std::ranges::count_if(last_->landmarks, [](LandmarkId id) { return id.IsValid(); }));
  Outcome outcome = Outcome::Tracked(TrackingState::kRelocalized,
                                     last_->cam_from_reference * *reference, seen, seen);
  if (!map.keyframes.Contains(last_->reference)) return outcome;
  outcome.depth = map.MedianDepth(last_->reference);
  StateCertainty(last_->frame, map, last_->covariance, last_->reference, outcome);
  return outcome;
}

void Tracker::MakeKeyframe(const Frame& frame, const Map& map, const TrackReport& tracked,
                           Outcome& outcome) {
  if (IsOnProbation(frame.timestamp))
    return;  // until the relocalized pose is proven the map is not changed
  const KeyframeEvidence evidence{
      .seconds_since_keyframe = std::abs(frame.timestamp - newest_keyframe_time_),
      .mapper_idle = !newest_keyframe_.IsValid() || map.keyframes.Contains(newest_keyframe_) ||
                     map.retired.Contains(newest_keyframe_),
      .matched = tracked.matched,
      .inliers = tracked.inliers,
      .reference_landmarks =
          map.CountTrackedLandmarks(tracked.reference, map.keyframes.size() > 2 ? 3 : 2),
      .inliers_at_keyframe = newest_keyframe_inliers_};
  const auto knows_way = [&] {
    const auto motion = keyframe_motions_.empty()
                            ? std::nullopt
                            : MotionSince(keyframe_motions_.back().second, frame);
    return motion && !motion->is_turn;
  };
  const KeyframeNeed need =
      outcome.state == TrackingState::kOdometry
          ? NeedsKeyframeByOdometry(view_has_changed_ && knows_way(), evidence, config_.tracking)
          : NeedsKeyframe(evidence, config_.tracking);
  if (need == KeyframeNeed::kNone) return;
  view_has_changed_ = false;
  anchors_.push_back({frame.motion, KeyframeId(next_keyframe_), {}});
  newest_keyframe_ = KeyframeId(next_keyframe_++);
  newest_keyframe_frame_ = frame.index;
  newest_keyframe_time_ = frame.timestamp;
  constexpr size_t kMostMotions = 30;  // the odometry's window mostly has fewer of these keyframes
  keyframe_motions_.emplace_back(newest_keyframe_, frame.motion);
  if (keyframe_motions_.size() > kMostMotions) keyframe_motions_.erase(keyframe_motions_.begin());
  newest_keyframe_inliers_ = tracked.inliers;
  trajectory_.MakeKeyframe(frame.index, newest_keyframe_);
  outcome.command = TakeRest();
  outcome.command->edit =
      KeyframeInsertion{newest_keyframe_,
                        {frame, tracked.cam_from_world, tracked.reference,
                         last_->cam_from_reference, tracked.landmarks, tracked.inliers},
                        MotionsToKeyframes(frame),
                        map.loops_closed};
  outcome.is_keyframe = true;
  outcome.is_urgent = need == KeyframeNeed::kUrgent;
}

MapCommand Tracker::TakeRest() {
  return {last_ ? last_->frame.index : newest_keyframe_frame_,
          {},
          TakeUses(),
          std::exchange(sightings_, {})};
}

void Tracker::ObserveObjects(const Frame& frame, const Map& map, const TrackReport& tracked,
                             Outcome& outcome) {
  const Stopwatch watch;
  TrackedFrame seen{frame,
                    tracked.cam_from_world,
                    tracked.reference,
                    RelativeTo(map, tracked.reference, tracked.cam_from_world),
                    tracked.landmarks,
                    tracked.inliers};
  if (frame.detections_follow)
    undetected_.back() = {std::move(seen), true};
  else
    outcome.objects = Associate(seen, map);
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

std::vector<LandmarkUse> Tracker::TakeUses() {
  std::ranges::stable_sort(uses_, {}, &LandmarkUse::landmark);
  std::vector<LandmarkUse> sums;
  for (const LandmarkUse& use : uses_) {
    if (sums.empty() || sums.back().landmark != use.landmark) sums.push_back({use.landmark, 0, 0});
    sums.back().visible += use.visible;
    sums.back().found += use.found;
  }
  uses_.clear();
  return sums;
}

}  // namespace oaslam
