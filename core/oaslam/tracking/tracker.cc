#include "oaslam/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "oaslam/relocalization/by_points.h"
#include "oaslam/tracking/initializer.h"
#include "oaslam/tracking/pose_tracking.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

// Poses are refined after this many images (5 s at 30 Hz), when the map around them has settled;
// until then the matches of an image are kept, about 5 KB each.
constexpr int kRefineAfter = 150;

FramePose FramePoseOf(const TrackedFrame& seen, TrackingState state) {
  return {seen.frame.index, seen.frame.timestamp, seen.reference, seen.cam_from_reference, state};
}

}  // namespace

Rigid3 Tracker::RelativeTo(const Map& map, KeyframeId reference, const Rigid3& cam_from_world) {
  return cam_from_world * map.keyframes.At(reference).cam_from_world.Inverse();
}

TrackedFrame Tracker::Placed(const Frame& frame, const Map& map, const TrackReport& tracked) {
  return {tracked, frame, RelativeTo(map, tracked.reference, tracked.cam_from_world)};
}

Tracker::Tracker(const SlamConfig& config, bool map_is_loaded)
    : config_(config),
      map_is_loaded_(map_is_loaded),
      phase_(Initializing()),
      search_(config),
      objects_(config.objects) {
  if (map_is_loaded) phase_ = Lost{};
}

void Tracker::Take(const Frame& frame) {
  objects_.Await(frame);
  keyframes_.Watch(frame);
  newest_ = {};
  newest_.frame = frame;
}

// Poses relative to a keyframe keep their lengths in the unit that it has.
void Tracker::FollowLoops(const Map& map) {
  const std::map<KeyframeId, double> changes = units_.ChangesIn(map);
  if (changes.empty()) return;
  trajectory_.Scale(changes);
  link_.Scale(changes);
  if (auto* following = std::get_if<Following>(&phase_))
    if (const auto change = changes.find(following->last.reference); change != changes.end())
      following->last.cam_from_reference.translation *= change->second;
}

TrackingStep Tracker::Track(const Frame& frame, const Map& map, const TrackingContext& context) {
  Take(frame);
  FollowLoops(map);
  BoundTrajectory(context);
  if (std::holds_alternative<Initializing>(phase_)) return Initialize(frame, context);
  if (std::holds_alternative<Following>(phase_)) return Follow(frame, map, context);
  return Search(frame, map, context);
}

// Without mapping the camera may be followed for days.
void Tracker::BoundTrajectory(const TrackingContext& context) {
  constexpr size_t kMost = 100'000;  // about an hour at 30 Hz
  if (context.IsMapping())
    last_mapped_ = newest_.frame.index;
  else if (trajectory_.KeepNewestAfter(last_mapped_, kMost) && !std::exchange(has_forgotten_, true))
    Log(LogLevel::kInfo,
        "the trajectory has only the newest {} poses from now on, since no map is made", kMost);
}

TrackingStep Tracker::PassOver(const Frame& frame, const Map& map, const TrackingContext& context) {
  Take(frame);
  return Miss(frame, map, context);
}

bool Tracker::NeedsFeatures(double timestamp, const FrameMotion* motion, MapUse use) const {
  // Two images at 30 Hz may pass in between. Other values were not measured.
  constexpr double kSeconds = 0.08;
  const auto* following = std::get_if<Following>(&phase_);
  return !following || timestamp - following->last.frame.timestamp > kSeconds ||
         !link_.CanCarry(timestamp, motion, use);
}

TrackingStep Tracker::Initialize(const Frame& frame, const TrackingContext& context) {
  if (!context.IsMapping()) return {PoseBeforeMap(nullptr)};
  TrackingStep step{PoseBeforeMap(frame.motion.get())};
  auto& phase = std::get<Initializing>(phase_);
  std::optional<InitialMap> initial = phase.initializer.Process(frame);
  if (!initial) return step;
  phase.first = initial->first_id = KeyframeId((*context.next_keyframe)++);
  phase.second = initial->second_id = KeyframeId((*context.next_keyframe)++);
  trajectory_.Clear();
  for (const auto& [image, id] :
       {std::pair{initial->first, phase.first}, std::pair{frame, phase.second}})
    trajectory_.Add({image.index, image.timestamp, id, {}, TrackingState::kTracking}, image, {});
  step.command =
      MapCommand{.frame_index = frame.index, .edit = *std::move(initial), .is_urgent = true};
  return step;
}

bool Tracker::AwaitsMap() const {
  const auto* initializing = std::get_if<Initializing>(&phase_);
  return initializing && initializing->second.IsValid();
}

TrackingStep Tracker::Begin(const Frame& frame, const Map& map) {
  auto& phase = std::get<Initializing>(phase_);
  const std::vector<Frame> before = phase.initializer.Reset();
  const KeyframeId first = std::exchange(phase.first, {}), second = std::exchange(phase.second, {});
  const Keyframe* keyframe = map.keyframes.Find(second);
  if (!keyframe) {
    trajectory_.Clear();
    return {PoseBeforeMap(frame.motion.get())};
  }
  const auto landmarks = static_cast<int>(map.landmarks.size());
  const double depth = map.MedianDepth(second);
  link_.Begin(frame, second, depth);
  keyframes_.Made(second, frame.timestamp, landmarks);
  uses_.clear();
  newest_.landmarks = keyframe->landmarks;
  for (const FrameBeforeMap& image :
       PlaceFramesBeforeMap(before, map, first, *frame.motion, depth, Demands()))
    trajectory_.Add(image.pose, image.frame, image.landmarks);
  const PoseByLandmarks pose{keyframe->cam_from_world, second, keyframe->landmarks, landmarks};
  TrackReport tracked;
  static_cast<PoseByLandmarks&>(tracked) = pose;
  tracked.matched = landmarks;
  tracked.depth = depth;
  auto& following = phase_.emplace<Following>(TrackedFrame{pose, frame, {}});
  return {.pose = certainty_.PoseToReport(frame, map, tracked, TrackingState::kTracking, link_,
                                          following.best_confidence),
          .keyframe = second};
}

TrackingStep Tracker::Follow(const Frame& frame, const Map& map, const TrackingContext& context) {
  const TrackedFrame& last = std::get<Following>(phase_).last;
  if (frame.motion && frame.motion->exchanged_since && context.use == MapUse::kExtend)
    if (auto corrected = Correct(frame, map, context)) return *std::move(corrected);
  const auto predicted = link_.Predict(frame, map, context.use);
  if (predicted && frame.features_skipped) return Carry(frame, map, *predicted, context);
  // In a map that is only read, finding an image costs little more than following it, and the last
  // pose tells little where it is long ago and nothing tells how far the camera has moved since.
  constexpr double kLongAgo = 0.3;  // seconds
  const bool knows_way = predicted && !predicted->is_turn;
  if (context.use == MapUse::kRead && !knows_way &&
      frame.timestamp - last.frame.timestamp > kLongAgo) {
    phase_ = Lost{};
    return Search(frame, map, context);
  }
  TrackDemands demands = Demands();
  // After images of which only the turn was known, the map is found again as by a relocalization.
  if (predicted && predicted->is_turn && last.frame.timestamp != link_.seen_at())
    demands.inliers = demands.least_inliers = kMinRelocalizationInliers;
  const TrackReport tracked = predicted ? FollowMotion(frame, map, last, *predicted, demands)
                                        : FollowWithoutMotion(frame, map, last, demands);
  if (tracked.success) return Continue(frame, map, tracked, TrackingState::kTracking, context);
  if (predicted && !context.IsMapping())
    if (auto found = LookAgain(frame, map, context)) return *std::move(found);
  if (predicted) return Continue(frame, map, tracked, TrackingState::kOdometry, context);
  constexpr int kSmallMap = 6;  // keyframes; one with fewer is made again at once
  const auto keyframes = static_cast<int>(map.keyframes.size() + map.retired.size());
  if (!context.IsMapping() || map_is_loaded_ || !map.anchors.empty() || map.IsMetricByUser() ||
      keyframes >= kSmallMap) {
    phase_ = Lost{};
    return Search(frame, map, context);
  }
  phase_ = GivenUp{};
  return {{.state = TrackingState::kInitializing}};
}

TrackingStep Tracker::Search(const Frame& frame, const Map& map, const TrackingContext& context) {
  const auto* lost = std::get_if<Lost>(&phase_);
  return PlaceFound(frame, map, Find(frame, map, context, lost ? lost->prior : std::nullopt),
                    context);
}

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

TrackingStep Tracker::Continue(const Frame& frame, const Map& map, const TrackReport& tracked,
                               TrackingState state, const TrackingContext& context) {
  const bool is_seen = state != TrackingState::kOdometry;
  const TrackedFrame seen = Placed(frame, map, tracked);
  Following& following = Remember(seen, tracked, state, map);
  TrackingStep step{
      certainty_.PoseToReport(frame, map, tracked, state, link_, following.best_confidence)};
  ObserveObjects(seen, map, context, step);
  if (is_seen && context.use != MapUse::kHold) PlaceLostImages(seen, map);
  if (is_seen && context.use == MapUse::kHold)
    step.located = TrackedAt(tracked.cam_from_world, map.MedianDepth(tracked.reference));
  if (context.use == MapUse::kRead) {
    TakeRest();
    if (is_seen)
      search_.Register(frame, map, TrackedAt(tracked.cam_from_world, tracked.depth),
                       link_.UnitFor(frame));
  } else if (state != TrackingState::kRelocalized && context.use == MapUse::kExtend) {
    MakeKeyframe(seen, map, tracked, context, step);  // once the next image confirms the place
  }
  return step;
}

// The odometry has found that its last motion was wrong: what was mapped by it is corrected, and
// the image follows the new motion from the newest keyframe that was right.
std::optional<TrackingStep> Tracker::Correct(const Frame& frame, const Map& map,
                                             const TrackingContext& context) {
  const std::optional<KeyframeId> right = link_.Correct(frame);
  const auto predicted = right ? link_.Predict(frame, map, context.use) : std::nullopt;
  if (!predicted || frame.features_skipped) return std::nullopt;
  TrackReport tracked = ByMotionAlone(*predicted);
  tracked.landmarks.resize(frame.features->size());
  tracked.depth = predicted->depth;
  const TrackedFrame seen = Placed(frame, map, tracked);
  Following& following = Remember(seen, tracked, TrackingState::kOdometry, map);
  TrackingStep step{certainty_.PoseToReport(frame, map, tracked, TrackingState::kOdometry, link_,
                                            following.best_confidence)};
  ObserveObjects(seen, map, context, step);
  InsertKeyframe(seen, map, tracked, context, step);
  std::get<KeyframeInsertion>(step.command->edit).right_until = *right;
  step.command->is_urgent = true;
  certainty_ = {};  // what ties the map changes with it
  return step;
}

// Goes on by the motion since the last image, without having looked for the map: its landmarks are
// shown where they must be.
TrackingStep Tracker::Carry(const Frame& frame, const Map& map, const OdometryPrediction& predicted,
                            const TrackingContext& context) {
  constexpr double kSeconds = 0.2;  // since the map was seen
  auto& [last, best_confidence] = std::get<Following>(phase_);
  Features features = *frame.features;
  TrackReport carried = CarryByMotion(frame, map, last, predicted, features);
  carried.depth = link_.depth();
  newest_.frame.features = std::make_shared<const Features>(std::move(features));
  newest_.landmarks = carried.landmarks;
  const TrackingState state = frame.timestamp - link_.seen_at() < kSeconds
                                  ? TrackingState::kTracking
                                  : TrackingState::kOdometry;
  TrackingStep step{certainty_.PoseToReport(frame, map, carried, state, link_, best_confidence)};
  const TrackedFrame seen = Placed(newest_.frame, map, carried);
  ObserveObjects(seen, map, context, step);
  if (!context.IsMapping()) TakeRest();
  if (const auto motion = link_.MotionSince(last.frame.motion, frame))
    trajectory_.AddCarried(FramePoseOf(seen, state), last.frame.index, motion->cam_from_cam);
  else
    trajectory_.Add(FramePoseOf(seen, state), frame, {});
  return step;
}

Following& Tracker::Remember(const TrackedFrame& seen, const TrackReport& tracked,
                             TrackingState state, const Map& map) {
  constexpr double kSpreadSeconds = 3;  // time constant of usual_spread_
  auto* following = std::get_if<Following>(&phase_);
  const TrackedFrame* before = following ? &following->last : nullptr;
  const Frame& frame = seen.frame;
  const double seconds = before ? std::abs(frame.timestamp - before->frame.timestamp) : 0;
  usual_spread_ = usual_spread_ > 0 ? std::lerp(tracked.spread, usual_spread_,
                                                std::exp(-seconds / kSpreadSeconds))
                                    : tracked.spread;
  if (state != TrackingState::kOdometry) link_.See(seen, tracked.depth, map, before);
  if (frame.index == newest_.frame.index) newest_.landmarks = tracked.landmarks;
  trajectory_.Add(FramePoseOf(seen, state), frame, tracked.landmarks);
  trajectory_.RefinePosesBefore(map, frame.index - kRefineAfter);
  for (const LandmarkId id : tracked.visible) uses_.push_back({id, 1, 0});
  for (const LandmarkId id : tracked.landmarks)
    if (id.IsValid()) uses_.push_back({id, 0, 1});
  if (!following) return phase_.emplace<Following>(seen);
  following->last = seen;
  return *following;
}

void Tracker::ObserveObjects(const TrackedFrame& seen, const Map& map,
                             const TrackingContext& context, TrackingStep& step) {
  const Stopwatch watch;
  step.pose.objects = objects_.Observe(seen, map, *context.next_object);
  step.ms_objects = watch.WallMs();
}

void Tracker::MakeKeyframe(const TrackedFrame& seen, const Map& map, const TrackReport& tracked,
                           const TrackingContext& context, TrackingStep& step) {
  const KeyframeNeed need = keyframes_.Need(seen.frame, map, tracked, step.pose.state, link_);
  if (need == KeyframeNeed::kNone) return;
  InsertKeyframe(seen, map, tracked, context, step);
  step.command->is_urgent = need == KeyframeNeed::kUrgent;
}

void Tracker::InsertKeyframe(const TrackedFrame& seen, const Map& map, const TrackReport& tracked,
                             const TrackingContext& context, TrackingStep& step) {
  const Frame& frame = seen.frame;
  const KeyframeId id((*context.next_keyframe)++);
  link_.AddKeyframe(id, frame);
  keyframes_.Made(id, frame.timestamp, tracked.inliers);
  trajectory_.MakeKeyframe(frame.index, id);
  step.keyframe = id;
  step.command = TakeRest();
  step.command->edit =
      KeyframeInsertion{id, seen, link_.MotionsToKeyframes(frame), map.loops_closed};
}

// Gives the images in which the camera was lost, and which have no pose yet, the one by the motion
// from there to where it was found.
void Tracker::PlaceLostImages(const TrackedFrame& found, const Map& map) {
  for (const LostCamera::Image& lost : search_.TakeImages()) {
    const auto motion = link_.MotionSince(lost.motion, found.frame);
    if (!motion || motion->is_turn || trajectory_.PoseOf(lost.frame_index)) continue;
    const Rigid3 cam_from_world = motion->cam_from_cam.Inverse() * found.cam_from_world;
    trajectory_.Add({lost.frame_index, lost.timestamp, found.reference,
                     RelativeTo(map, found.reference, cam_from_world), TrackingState::kOdometry},
                    found.frame, {});
  }
}

void Tracker::GoOnAs(Tracker other, double scale) {
  other.Scale(scale);
  // These belong to this map.
  trajectory_.Join(std::move(other.trajectory_));
  other.trajectory_ = std::move(trajectory_);
  other.objects_.AddBefore(std::move(objects_));
  search_.Forget();
  search_.TakeImages();
  other.search_ = std::move(search_);
  other.newest_.relocalization = newest_.relocalization;
  other.map_is_loaded_ = map_is_loaded_;
  other.certainty_ = {};
  other.units_.BeginAnew();
  *this = std::move(other);
}

void Tracker::Scale(double factor) {
  certainty_.Scale(factor);
  if (auto* following = std::get_if<Following>(&phase_)) following->last.ScaleLengths(factor);
  if (auto* lost = std::get_if<Lost>(&phase_))
    if (lost->prior) lost->prior->translation *= factor;
  link_.Scale(factor);
  search_.Forget();
  objects_.Scale(factor);
  trajectory_.Scale(factor);
}

void Tracker::ForceRelocalization(const std::optional<Rigid3>& near) {
  search_.Forget();
  if (std::holds_alternative<Following>(phase_) || std::holds_alternative<Lost>(phase_))
    phase_ = Lost{.prior = near, .is_pose_doubted = true};
}

ImagePose Tracker::Present(const Map& map) {
  auto* following = std::get_if<Following>(&phase_);
  const auto reference = following ? map.ResolveKeyframe(following->last.reference) : std::nullopt;
  if (!reference) return {};
  const TrackedFrame& last = following->last;
  TrackReport tracked;
  tracked.cam_from_world = last.cam_from_reference * *map.ResolvePose(last.reference);
  tracked.reference = reference->by;
  tracked.matched = tracked.inliers = static_cast<int>(
      std::ranges::count_if(last.landmarks, [](LandmarkId id) { return id.IsValid(); }));
  tracked.depth = map.MedianDepth(reference->by);
  tracked.covariance = last.covariance;
  return certainty_.PoseToReport(last.frame, map, tracked, TrackingState::kRelocalized, link_,
                                 following->best_confidence);
}

std::string Tracker::why_no_map() const {
  const auto* initializing = std::get_if<Initializing>(&phase_);
  return initializing ? initializing->initializer.why_not() : "";
}

FrameView Tracker::View() const {
  FrameView view = newest_;
  view.detected = objects_.ObjectsIn(newest_.frame);
  if (const FramePose* pose = trajectory_.PoseOf(newest_.frame.index)) view.pose = *pose;
  return view;
}

MapCommand Tracker::TakeRest() {
  std::ranges::stable_sort(uses_, {}, &LandmarkUse::landmark);
  std::vector<LandmarkUse> sums;
  for (const LandmarkUse& use : std::exchange(uses_, {})) {
    if (sums.empty() || sums.back().landmark != use.landmark) sums.push_back({use.landmark, 0, 0});
    sums.back().visible += use.visible;
    sums.back().found += use.found;
  }
  return {newest_.frame.index, {}, std::move(sums), objects_.TakeSightings()};
}

std::optional<TrackingStep> Tracker::AddDetections(int frame_index,
                                                   std::vector<ObjectDetection> detections,
                                                   const Map& map, const TrackingContext& context) {
  std::optional<TrackedFrame> late = objects_.TakeAwaited(frame_index);
  if (!late) return std::nullopt;
  late->frame.detections = std::move(detections);
  late->frame.detections_follow = false;
  if (!late->reference.IsValid()) {
    if (!std::holds_alternative<Lost>(phase_) || late->frame.timestamp <= link_.seen_at())
      return std::nullopt;
    return PlaceFound(late->frame, map, search_.FindAlone(late->frame, map, context.search),
                      context);
  }
  const auto reference = map.ResolvePose(late->reference);
  if (!reference) return std::nullopt;
  late->cam_from_world = late->cam_from_reference * *reference;
  TrackingStep step{{.state = TrackingState::kTracking,
                     .source = PoseSource::kMap,
                     .cam_from_world = late->cam_from_world,
                     .inliers = late->inliers}};
  step.pose.objects = objects_.Observe(*late, map, *context.next_object);
  return step;
}

std::optional<double> Tracker::MotionUnit(const Frame& frame) const {
  if (const std::optional<double> by_points = link_.UnitFor(frame)) return by_points;
  const auto registered = search_.Registered(frame);
  return registered ? std::optional(registered->unit) : std::nullopt;
}

bool Tracker::HasTracked(int frame_index) const {
  const FramePose* pose = trajectory_.PoseOf(frame_index);
  return pose && pose->state != TrackingState::kObjects;
}

std::optional<Rigid3> Tracker::PoseOf(int frame_index, const Map& map) const {
  const FramePose* pose = trajectory_.PoseOf(frame_index);
  const std::optional<Rigid3> reference = pose ? map.ResolvePose(pose->reference) : std::nullopt;
  return reference ? std::optional(pose->cam_from_reference * *reference) : std::nullopt;
}

}  // namespace oaslam
