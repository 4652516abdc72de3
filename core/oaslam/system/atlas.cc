#include "oaslam/system/atlas.h"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "oaslam/map/renumbering.h"
#include "oaslam/mapping/keyframe_description.h"
#include "oaslam/mapping/submap_joining.h"
#include "oaslam/objects/moved_objects.h"

namespace oaslam {
namespace {

constexpr double kPatience = 0.33;  // seconds; most losses are shorter
// Seconds in which a camera that was found again is tracked in both submaps: mostly they are
// joined.
constexpr double kInBoth = 0.5;

// An empty map with the same cameras and class relations, whose versions and landmarks go on from
// there.
Map EmptyLike(const Map& map) {
  Map empty;
  empty.cameras = map.cameras;
  empty.classes = map.classes;
  empty.version = map.version;
  empty.next_landmark = map.next_landmark;
  return empty;
}

// There is no map yet.
bool IsBeginning(const ImagePose& pose) {
  return pose.state == TrackingState::kInitializing || pose.state == TrackingState::kPreliminary;
}

}  // namespace

Atlas::Atlas(const SlamConfig& config, Map map, bool is_loaded, std::vector<Submap> others)
    : config_(config), is_loaded_(is_loaded), next_object_(NextObjectOf(map)) {
  const std::vector<Camera> cameras = map.cameras;
  const uint32_t next_keyframe = NextIdsOf(map).keyframe;
  main_ = &Begin(std::move(map), is_loaded, next_keyframe);
  for (Submap& other : others) {
    other.map.cameras = cameras;
    next_object_ = std::max(next_object_, NextObjectOf(other.map));
    submaps_.push_back({next_number_++, nullptr, 0, std::move(other), Relocalizer(config_)});
  }
}

// Adds a submap in which the camera is tracked. `has_map`: it is looked for in `map`, and no
// initial map is made.
AtlasSubmap& Atlas::Begin(Map map, bool has_map, uint32_t next_keyframe) {
  submaps_.push_back({next_number_++,
                      std::make_unique<Session>(config_, std::move(map), has_map),
                      next_keyframe,
                      {},
                      Relocalizer(config_)});
  return submaps_.back();
}

MapUse Atlas::use() const {
  if (!mapping_) return MapUse::kRead;
  return growing_ ? MapUse::kHold : MapUse::kExtend;
}

TrackingContext Atlas::MainContext() {
  return {use(), mode_, &main_->next_keyframe, &next_object_};
}

bool Atlas::NeedsFeatures(double timestamp, const FrameMotion* motion) const {
  return growing_ || lost_since_ || main().tracker().NeedsFeatures(timestamp, motion, use());
}

TrackingStep Atlas::Process(const Frame& frame) {
  // Searches take more time than tracking: while a submap grows, each third image at 30 Hz.
  constexpr double kSeconds = 0.09;
  const bool looks = !growing_ || !last_vain_look_ || frame.timestamp - *last_vain_look_ > kSeconds;
  TrackingStep step =
      looks ? main().Process(frame, MainContext()) : main().PassOver(frame, MainContext());
  const bool is_vain = IsLost(step.pose.state) && !step.located;
  if (looks) last_vain_look_ = is_vain ? std::optional(frame.timestamp) : std::nullopt;
  if (main().tracker().HasGivenUp()) return GoOnElsewhere(frame);
  if (mapping_ && !IsBeginning(step.pose)) step.pose = ProcessGrowing(frame, step);
  return step;
}

// The main submap is too small to find the camera again: the growing one leads, or an empty one,
// which begins with this frame.
TrackingStep Atlas::GoOnElsewhere(const Frame& frame) {
  AtlasSubmap& given_up = *main_;
  lost_since_.reset();
  last_vain_look_.reset();
  Lead(growing_ ? *std::exchange(growing_, std::nullopt)->submap
                : Begin(EmptyLike(*given_up.session->snapshot()), false, 0));
  Rest(given_up);
  return main().Process(frame, MainContext());
}

// After a frame was processed in the main submap: begins, continues, joins, promotes or ends the
// growing one. Returns the pose to report.
ImagePose Atlas::ProcessGrowing(const Frame& frame, const TrackingStep& in_main) {
  const AtlasSubmap* const main_before = main_;
  const bool is_found = !IsLost(in_main.pose.state);
  const bool is_seen = is_found && in_main.pose.seconds_without_map == 0;
  const auto note = [&](bool is_so, std::optional<double>& since) {
    if (!is_so || !since) since = is_so ? std::optional(frame.timestamp) : std::nullopt;
  };
  const auto have_passed = [&](double seconds, const std::optional<double>& since) {
    return since && frame.timestamp - *since >= seconds;
  };
  note(!is_found, lost_since_);
  if (in_main.keyframe) LookFrom(frame, *main_);
  if (!growing_ && !have_passed(kPatience, lost_since_)) return in_main.pose;
  if (!growing_ || (!is_found && have_passed(kPatience, growing_->lost_since))) BeginGrowing();
  Session& session = growing_->session();
  const TrackingStep there = session.Process(frame, GrowingContext());
  growing_->pose = there.pose;
  note(IsLost(there.pose.state), growing_->lost_since);
  note(is_seen, growing_->found_since);
  if (session.tracker().HasGivenUp() || have_passed(kInBoth, growing_->found_since)) {
    EndGrowing();
    return in_main.pose;
  }
  if (in_main.located) growing_->to_main.Add(frame.index, *in_main.located);
  if (there.keyframe) LookFrom(frame, *growing_->submap);
  if (growing_ && !JoinGrowing()) {
    const bool is_larger =
        session.snapshot()->keyframes.size() > main().snapshot()->keyframes.size();
    if (!is_larger || is_found || IsLost(there.pose.state) || MustStayMain()) return in_main.pose;
    AtlasSubmap& smaller = *main_;
    Lead(*std::exchange(growing_, std::nullopt)->submap);
    Rest(smaller);
  }
  lost_since_.reset();
  const ImagePose now = main().tracker().Present(*main().snapshot());
  // A pose in the former main submap is none in the present one.
  return now.cam_from_world || main_ != main_before ? now : in_main.pose;
}

std::optional<std::pair<int, ImagePose>> Atlas::PoseInGrowing() const {
  if (!growing_ || IsLost(growing_->pose.state) || IsBeginning(growing_->pose)) return std::nullopt;
  return std::pair{growing_->submap->number, growing_->pose};
}

// Ends the submap that grows, if there is one, and begins another. It shares no id with the others:
// whichever of them it is joined with, that one keeps the ids that the application knows.
void Atlas::BeginGrowing() {
  EndGrowing();
  main().Submit(AdoptAdjustment{});
  Map empty = EmptyLike(*main().snapshot());
  uint32_t next_keyframe = main_->next_keyframe;
  for (const AtlasSubmap* waiting : Waiting()) {
    const NextIds next = NextIdsOf(waiting->content.map);
    next_keyframe = std::max(next_keyframe, next.keyframe);
    empty.next_landmark = std::max(empty.next_landmark, next.landmark);
  }
  growing_ = Growth{&Begin(std::move(empty), false, next_keyframe)};
}

// Ends the growing submap, if there is one: it waits.
void Atlas::EndGrowing() {
  if (growing_) Rest(*std::exchange(growing_, std::nullopt)->submap);
}

std::vector<AtlasSubmap*> Atlas::Waiting() {
  std::vector<AtlasSubmap*> waiting;
  for (AtlasSubmap& submap : submaps_)
    if (submap.IsWaiting()) waiting.push_back(&submap);
  return waiting;
}

// Exchanges the main submap with a larger waiting one, if there is one.
void Atlas::PromoteLargest() {
  const std::vector<AtlasSubmap*> waiting = Waiting();
  const auto largest = std::ranges::max_element(waiting, {}, &AtlasSubmap::keyframes);
  if (MustStayMain() || largest == waiting.end() ||
      (*largest)->keyframes() <= main().snapshot()->keyframes.size())
    return;
  AtlasSubmap& smaller = *main_;
  Wake(**largest);
  Lead(**largest);
  Rest(smaller);
}

// Gives a waiting submap a session, in which the camera is lost.
void Atlas::Wake(AtlasSubmap& waiting) {
  Submap content = std::exchange(waiting.content, {});
  const NextIds next = NextIdsOf(content.map);
  waiting.next_keyframe = next.keyframe;
  next_object_ = std::max(next_object_, next.object);
  waiting.session = std::make_unique<Session>(config_, std::move(content.map), true);
  waiting.session->tracker().Adopt(content.trajectory, 1);
}

// Makes a submap in which the camera is tracked the main one.
void Atlas::Lead(AtlasSubmap& submap) {
  main_ = &submap;
  metre_.reset();
  is_loaded_ = false;
}

// Ends the session of a submap, which waits from then on with all that its tracker has seen; one
// that is empty goes. Keeps its failure.
void Atlas::Rest(AtlasSubmap& submap) {
  Session& session = *submap.session;
  // A background adjustment ends with the session: it is applied first. In live mode, which does
  // not wait for it, it is lost, and Finish adjusts the map again.
  session.SubmitRest(AdoptAdjustment{});
  if (!failure_) failure_ = session.failure();
  session.tracker().RefineTrajectory(*session.snapshot());
  submap.content = {*session.snapshot(), session.tracker().trajectory()};
  submap.seen_at = session.tracker().seen_at();
  End(std::move(submap.session));
  if (submap.content.map.keyframes.empty()) return Erase(submap);
  DescribeKeyframes(submap.content.map);
  const auto it = std::ranges::find(submaps_, &submap, [](const AtlasSubmap& s) { return &s; });
  submaps_.splice(submaps_.end(), submaps_, it);
}

void Atlas::Erase(const AtlasSubmap& submap) {
  submaps_.remove_if([&](const AtlasSubmap& other) { return &other == &submap; });
}

// Destroys a session; its background adjustment takes some tenths of a second to stop. In live mode
// another thread does that, and the camera waits only where the session before is still being
// destroyed.
void Atlas::End(std::unique_ptr<Session> session) {
  if (config_.runner.mode == RunnerMode::kLive)
    ending_ = std::jthread([session = std::move(session)]() mutable { session.reset(); });
}

std::vector<Submap> Atlas::Others() {
  std::vector<Submap> others;
  for (const AtlasSubmap* waiting : Waiting()) others.push_back(waiting->content);
  if (growing_) {
    const std::shared_ptr<const Map> map = growing_->session().Mapped();
    if (!map->keyframes.empty()) {
      others.push_back({*map, growing_->session().tracker().trajectory()});
      DescribeKeyframes(others.back().map);
    }
  }
  std::ranges::stable_sort(others, std::greater(),
                           [](const Submap& other) { return other.map.keyframes.size(); });
  NextIds free = NextIdsOf(*main().Mapped());
  for (Submap& other : others) {
    other = Renumbered(other, free);
    free = NextIdsOf(other.map);
  }
  return others;
}

// Whether the user needs poses in the frame of the main submap: it was loaded, has anchors, or was
// scaled to metres by the user.
bool Atlas::MustStayMain() const {
  const Map& map = *main().snapshot();
  return (is_loaded_ && !map.keyframes.empty()) || !map.anchors.empty() || map.IsMetricByUser() ||
         metre_;
}

void Atlas::Finish() {
  if (growing_) {
    growing_->session().Newest();
    if (!JoinGrowing()) EndGrowing();
  }
  if (mapping_ && !failure()) {
    main().SubmitRest();
    JoinAll();
    PromoteLargest();
  }
  main().Finish(use());
  if (mapping_ && !failure())
    for (AtlasSubmap* waiting : Waiting()) OptimizeSubmap(config_, waiting->content.map);
}

std::exception_ptr Atlas::failure() {
  if (failure_) return failure_;
  if (const std::exception_ptr failure = main().failure()) return failure;
  return growing_ ? growing_->session().failure() : nullptr;
}

std::optional<TrackingStep> Atlas::AddDetections(int frame_index,
                                                 const std::vector<ObjectDetection>& detections) {
  std::optional<TrackingStep> step = main().AddDetections(frame_index, detections, MainContext());
  if (step && step->pose.state == TrackingState::kRelocalized) {
    lost_since_.reset();
    last_vain_look_.reset();
  }
  if (!growing_) return step;
  growing_->session().AddDetections(frame_index, detections, GrowingContext());
  if (step && step->located) growing_->to_main.Add(frame_index, *step->located);
  return step;
}

void Atlas::SetMapping(bool enabled) {
  if (mapping_ == enabled) return;
  if (!enabled) main().SubmitRest();
  EndGrowing();
  lost_since_.reset();
  mapping_ = enabled;
}

void Atlas::SetMetresPerUnit(double metres, const std::optional<UnitEvidence>& by_objects) {
  EndGrowing();
  main().ScaleToMetres(metres, by_objects);
  if (main().failure()) return;
  ScaleJoinings(main_->number, metres);
}

void Atlas::ForceRelocalization(const std::optional<Rigid3>& near) {
  main().tracker().ForceRelocalization(near);
  EndGrowing();
  lost_since_.reset();
}

void Atlas::SetClassRelations(const ClassRelations& relations) {
  for (AtlasSubmap* waiting : Waiting()) oaslam::SetClassRelations(relations, waiting->content.map);
  if (growing_) growing_->session().Submit(relations);
  main().Submit(relations);
}

}  // namespace oaslam
