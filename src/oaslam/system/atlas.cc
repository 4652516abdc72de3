#include "oaslam/system/atlas.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/map/next_ids.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// An empty map with the same cameras and class relations, whose versions go on from there.
Map EmptyLike(const Map& map, uint32_t first_landmark) {
  Map empty;
  empty.cameras = map.cameras;
  empty.classes = map.classes;
  empty.version = map.version;
  empty.next_landmark = first_landmark;
  return empty;
}

bool IsLost(const Tracker::Outcome& outcome) {
  return outcome.state == TrackingState::kLost || outcome.state == TrackingState::kObjects;
}

// There is no map yet.
bool IsBeginning(const Tracker::Outcome& outcome) {
  return outcome.state == TrackingState::kInitializing ||
         outcome.state == TrackingState::kPreliminary;
}

}  // namespace

Atlas::Atlas(const SlamConfig& config, Map map, bool is_loaded, std::vector<Piece> others)
    : config_(config), waiting_(config) {
  for (Piece& piece : others) {
    piece.map.cameras = map.cameras;
    free_ids_ = Behind(free_ids_, NextIdsOf(piece.map));
    waiting_.Add(std::move(piece), ++last_number_);
  }
  BeginMain(std::move(map), is_loaded);
  is_loaded_ = is_loaded;
}

// Makes `map` the main piece. `has_map`: the camera is looked for in it, and no initial map is
// made.
void Atlas::BeginMain(Map map, bool has_map) {
  const NextIds ids = Behind(free_ids_, NextIdsOf(map));
  map.next_landmark = ids.landmark;
  is_loaded_ = false;
  End(std::exchange(main_, std::make_unique<Session>(config_, std::move(map), ids, has_map)));
  main_->tracker().SetRelocalizationMode(mode_);
  main_->tracker().SetMapping(mapping_);
}

bool Atlas::NeedsFeatures(double timestamp, const FrameMotion* motion) const {
  return growing_ || lost_since_ || main_->tracker().NeedsFeatures(timestamp, motion);
}

Tracker::Outcome Atlas::Process(const Frame& frame) {
  newest_frame_ = frame.index;
  // Ids must stay unique across both pieces. While the camera is lost in the main one, that may
  // make objects only, whose next id its tracker knows. Once the camera is found there, it may make
  // keyframes and landmarks, too; the ids of landmarks are the mappers', for which this waits.
  if (growing_) {
    if (lost_since_)
      main_->tracker().SkipIds(growing_->session().tracker().next_ids());
    else
      main_->SkipIds(growing_->session().next_ids(), frame.index);
  }
  const bool looks = MayLook(frame);
  Tracker::Outcome outcome = looks ? main_->Process(frame) : main_->PassOver(frame);
  const bool is_vain = IsLost(outcome) && !outcome.located;
  if (looks) last_vain_look_ = is_vain ? std::optional(frame.timestamp) : std::nullopt;
  if (outcome.gives_up) {  // the main piece is too small to find the camera again
    EndGrowingPiece(frame.index);
    Park(*main_);
    BeginMain(EmptyLike(*main_->snapshot(), free_ids_.landmark), false);
    main_number_ = ++last_number_;
  }
  return mapping_ ? UpdateGrowingPiece(frame, std::move(outcome)) : outcome;
}

// Whether to look for the camera in the main piece. With mapping, while a new piece grows, not
// shortly after a failed attempt.
bool Atlas::MayLook(const Frame& frame) const {
  constexpr double kSeconds = 0.09;  // three images at 30 Hz; searches take more time than tracking
  if (!growing_ || !last_vain_look_) return true;
  return frame.timestamp - *last_vain_look_ > kSeconds;
}

// After a frame was processed in the main piece: begins, continues, joins, promotes or ends the
// growing piece. Returns the outcome to report.
Tracker::Outcome Atlas::UpdateGrowingPiece(const Frame& frame, Tracker::Outcome outcome) {
  if (IsBeginning(outcome)) return outcome;
  const bool is_lost = IsLost(outcome);
  if (!is_lost)
    lost_since_.reset();
  else if (!lost_since_)
    lost_since_ = frame.timestamp;
  // The camera is found by points and has passed its probation. On probation (`outcome.located` is
  // set) it makes no keyframes in the main map, and the new piece may still be joined.
  if (!is_lost && !outcome.located) EndGrowingPiece(frame.index);
  if (outcome.is_keyframe) waiting_.LookFor(frame, mode_, *main_);
  const bool is_lost_for_long =
      lost_since_ && frame.timestamp - *lost_since_ >= GrowingPiece::kPatience;
  if (!growing_ && !is_lost_for_long) return outcome;
  if (!growing_ || (is_lost && growing_->IsLost(frame.timestamp))) BeginGrowingPiece(frame.index);
  growing_->session().tracker().SkipIds(main_->tracker().next_ids());
  const Tracker::Outcome there = growing_->Process(frame, outcome.located);
  if (there.gives_up) {
    BeginGrowingPiece(frame.index);
    return outcome;
  }
  if (there.is_keyframe) waiting_.LookFor(frame, mode_, growing_->session());
  if (!JoinGrowingPiece(frame.index)) {
    const bool is_larger =
        growing_->session().snapshot()->keyframes.size() > main_->snapshot()->keyframes.size();
    if (!is_larger || !is_lost || IsLost(there) || MustStayMain()) return outcome;
    PromoteGrowingPiece();
  }
  lost_since_.reset();
  const Tracker::Outcome now = main_->tracker().Present(*main_->snapshot());
  return now.cam_from_world ? now : outcome;
}

// Ends the piece that is being made, if there is one, and begins a new one.
void Atlas::BeginGrowingPiece(int frame_index) {
  EndGrowingPiece(frame_index);
  main_->FinishAdjustment(frame_index);
  const NextIds ids = Behind(free_ids_, main_->next_ids());
  growing_.emplace(config_, EmptyLike(*main_->snapshot(), ids.landmark), ids);
  growing_->session().tracker().SetRelocalizationMode(mode_);
}

// Ends the growing piece, if there is one: it waits.
void Atlas::EndGrowingPiece(int frame_index) {
  if (!growing_) return;
  Park(growing_->session());
  End(growing_->TakeSession());
  growing_.reset();
  main_->SkipIds(free_ids_, frame_index);
}

// Joins the growing piece with the main one, in which the camera is then tracked as it was in the
// growing one. Returns false, and leaves the pieces as they are, where the transformation is not
// known yet, the camera would jump, or the mapping of the main piece has failed.
bool Atlas::JoinGrowingPiece(int frame_index) {
  // On the map that the tracker saw, since the newest one must be waited for. The commands that are
  // waited for may move the map, so that the alignment is made again.
  if (!growing_->Align()) return false;
  Session& found = growing_->session();
  const std::shared_ptr<const Map> map = found.Newest();
  const std::optional<PieceAlignment> alignment = growing_->Align();
  if (!alignment) return false;
  const Similarity& world_from_new = alignment->other_from_this;
  if (!IsContinuous(*main_->Newest(), main_->tracker().trajectory(), *map,
                    found.tracker().trajectory(), world_from_new))
    return false;
  if (!main_->Join(*map, world_from_new, frame_index)) return false;
  if (!failure_) failure_ = found.failure();
  main_->tracker().GoOnAs(std::move(found.tracker()), world_from_new.scale);
  End(growing_->TakeSession());
  growing_.reset();
  Log(LogLevel::kInfo,
      fmt::format("frame {}: a map made while lost was joined with the old one", frame_index));
  return true;
}

// Makes the growing piece, now larger than the main one, the main piece.
void Atlas::PromoteGrowingPiece() {
  Park(*main_);
  End(std::exchange(main_, growing_->TakeSession()));
  growing_.reset();
  is_loaded_ = false;
  main_number_ = ++last_number_;
}

// Destroys a session, if there is one; its background adjustment takes some tenths of a second to
// stop. In live mode another thread does that, and the camera waits only where the session before
// is still being destroyed.
void Atlas::End(std::unique_ptr<Session> session) {
  if (session && config_.runner.mode == RunnerMode::kLive)
    ending_ = std::jthread([session = std::move(session)]() mutable { session.reset(); });
}

// Copies a session's map, with all that its tracker has seen, and its trajectory to the waiting
// pieces, unless the map is empty. Keeps its failure, and its ids from being used again.
void Atlas::Park(Session& session) {
  MapCommand rest = session.tracker().TakeRest();
  rest.edit = AdoptAdjustment{};  // it would end with the session
  session.SubmitAndWait(std::move(rest));
  if (!failure_) failure_ = session.failure();
  const std::shared_ptr<const Map> map = session.snapshot();
  free_ids_ = Behind(free_ids_, session.next_ids());
  if (map->keyframes.size() == 0) return;
  session.tracker().RefineTrajectory(*map);
  const int number = &session == main_.get() ? main_number_ : ++last_number_;
  waiting_.Add({*map, session.tracker().trajectory()}, number);
}

std::vector<Piece> Atlas::Others() {
  std::vector<Piece> others = waiting_.All();
  if (!growing_) return others;
  const std::shared_ptr<const Map> map = growing_->session().Mapped();
  if (map->keyframes.size() == 0) return others;
  const auto size = [](const Piece& piece) { return piece.map.keyframes.size(); };
  const auto at =
      std::ranges::lower_bound(others, map->keyframes.size(), std::ranges::greater(), size);
  others.insert(at, {*map, growing_->session().tracker().trajectory()});
  return others;
}

// Whether the user needs poses in the frame of the main piece: it was loaded, has anchors, or was
// scaled to metres by the user.
bool Atlas::MustStayMain() const {
  const Map& map = *main_->snapshot();
  return (is_loaded_ && !map.keyframes.empty()) || !map.anchors.empty() || map.is_metric;
}

// Exchanges the main piece with a larger waiting one, if there is one.
void Atlas::PromoteLargest() {
  if (MustStayMain()) return;
  auto largest = waiting_.TakeLargest(main_->snapshot()->keyframes.size());
  if (!largest) return;
  Park(*main_);
  BeginMain(std::move(largest->piece.map), true);
  main_->tracker().Adopt(largest->piece.trajectory, 1);
  main_number_ = largest->number;
}

void Atlas::Finish() {
  if (growing_) growing_->session().Newest();  // for Align in JoinGrowingPiece
  if (growing_ && !JoinGrowingPiece(newest_frame_)) EndGrowingPiece(newest_frame_);
  if (mapping_ && !failure()) {
    main_->SubmitAndWait(main_->tracker().TakeRest());
    waiting_.JoinAll(mode_, newest_frame_, main_number_, *main_);
    PromoteLargest();
  }
  main_->Finish();
  if (mapping_ && !failure()) waiting_.Optimize();
}

std::exception_ptr Atlas::failure() {
  if (failure_) return failure_;
  if (const std::exception_ptr failure = main_->failure()) return failure;
  return growing_ ? growing_->session().failure() : nullptr;
}

std::optional<Tracker::Outcome> Atlas::AddDetections(
    int frame_index, const std::vector<ObjectDetection>& detections) {
  // Both pieces may make objects of them, with different ids.
  if (growing_) main_->tracker().SkipIds(growing_->session().tracker().next_ids());
  std::optional<Tracker::Outcome> outcome = main_->AddDetections(frame_index, detections);
  if (outcome && outcome->state == TrackingState::kRelocalized) {
    lost_since_.reset();
    last_vain_look_.reset();
  }
  if (!growing_) return outcome;
  growing_->session().tracker().SkipIds(main_->tracker().next_ids());
  growing_->AddDetections(frame_index, detections, outcome ? outcome->located : std::nullopt);
  return outcome;
}

void Atlas::SetRelocalizationMode(RelocalizationMode mode) {
  mode_ = mode;
  main_->tracker().SetRelocalizationMode(mode);
  if (growing_) growing_->session().tracker().SetRelocalizationMode(mode);
}

void Atlas::SetMapping(bool enabled) {
  if (mapping_ == enabled) return;
  if (!enabled) main_->SubmitAndWait(main_->tracker().TakeRest());
  EndGrowingPiece(newest_frame_);
  lost_since_.reset();
  mapping_ = enabled;
  main_->tracker().SetMapping(enabled);
}

void Atlas::SetMetresPerUnit(double metres) {
  EndGrowingPiece(newest_frame_);
  main_->ScaleToMetres(metres, newest_frame_);
}

void Atlas::ForceRelocalization(const std::optional<Rigid3>& near) {
  main_->tracker().ForceRelocalization(near);
  EndGrowingPiece(newest_frame_);
  lost_since_.reset();
}

void Atlas::SetClassRelations(const ClassRelations& relations) {
  // The next frame is the first that they apply to.
  const MapCommand command{newest_frame_ + 1, relations};
  waiting_.SetClassRelations(relations);
  if (growing_) growing_->session().SubmitAndWait(command);
  main_->SubmitAndWait(command);
}

}  // namespace oaslam
