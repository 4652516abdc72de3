#include "oaslam/system/atlas.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/objects/association.h"
#include "oaslam/objects/moved_objects.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/system/piece_joining.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// An empty map with the same cameras and class relations.
Map EmptyLike(const Map& map, uint32_t first_landmark) {
  Map empty;
  empty.cameras = map.cameras;
  empty.classes = map.classes;
  empty.version = map.version;
  empty.next_landmark = first_landmark;
  return empty;
}

NextIds Behind(const NextIds& a, const NextIds& b) {
  return {std::max(a.keyframe, b.keyframe), std::max(a.landmark, b.landmark),
          std::max(a.object, b.object)};
}

NextIds NextIdsOf(const Map& map) {
  NextIds ids{0, map.next_landmark, ObjectTracks::ContinueFrom(map).next_object};
  for (const KeyframeId id : map.keyframes.Ids())
    ids.keyframe = std::max(ids.keyframe, id.value + 1);
  for (const KeyframeId id : map.retired.Ids()) ids.keyframe = std::max(ids.keyframe, id.value + 1);
  return ids;
}

bool IsLost(const Tracker::Outcome& outcome) {
  return outcome.state == TrackingState::kLost || outcome.state == TrackingState::kObjects;
}

// world_from_piece, by frames that have a pose in both maps and by relocalizing keyframes of the
// piece in the other map. Returns nothing where these do not determine it.
std::optional<Similarity> Align(const Piece& piece, const Map& world,
                                const std::vector<FramePose>& trajectory, RelocalizationMode mode,
                                const SlamConfig& config, Relocalizer& relocalizer) {
  constexpr size_t kMaxKeyframes = 60, kMaxInVain = 15;
  const std::vector<KeyframeId> ids = piece.map.keyframes.Ids();
  const size_t step = (ids.size() + kMaxKeyframes - 1) / kMaxKeyframes;
  PieceLink link;
  link.AddCommon(world, trajectory, piece.trajectory);
  if (!link.CanAlign(ids.size())) return std::nullopt;
  size_t tried = 0, found = 0;
  for (size_t i = 0; i < ids.size() && (found > 0 || tried < kMaxInVain); i += step, ++tried) {
    const Frame frame = FrameOf(piece.map, ids[i]);
    Rng rng(static_cast<uint64_t>(config.runner.seed));
    const auto located =
        LocatedPoseOf(relocalizer.Find(frame, world, mode, frame.gravity_in_cam, rng), world);
    if (!located) continue;
    link.AddKeyframe(frame.index, *located);
    ++found;
  }
  return link.Align(piece.map, piece.trajectory);
}

}  // namespace

Atlas::Atlas(const SlamConfig& config, Map map, bool is_loaded, std::vector<Piece> others)
    : config_(config) {
  for (Piece& piece : others) {
    piece.map.cameras = map.cameras;
    free_ids_ = Behind(free_ids_, NextIdsOf(piece.map));
    waiting_.push_back({std::move(piece), Relocalizer(config_), {}, ++last_number_});
  }
  BeginMain(std::move(map), is_loaded);
}

void Atlas::BeginMain(Map map, bool is_loaded) {
  const NextIds ids = Behind(free_ids_, NextIdsOf(map));
  map.next_landmark = ids.landmark;
  is_loaded_ = is_loaded;
  main_ = std::make_unique<Session>(config_, std::move(map), ids, is_loaded);
  main_->tracker().SetRelocalizationMode(mode_);
  main_->tracker().SetMapping(mapping_);
  if (is_shut_down_) main_->Shutdown();
}

Tracker::Outcome Atlas::Process(const Frame& frame) {
  newest_frame_ = frame.index;
  // Ids must stay unique across both pieces: the main one may make objects while its camera is
  // lost, and keyframes and landmarks, too, once the camera is found.
  if (growing_ && lost_since_) main_->tracker().SkipIds(growing_->session().tracker().next_ids());
  if (growing_ && !lost_since_) main_->SkipIds(growing_->session().next_ids(), frame.index);
  const bool looks = MayLook(frame);
  Tracker::Outcome outcome = looks ? main_->Process(frame) : main_->PassOver(frame);
  const bool is_vain = IsLost(outcome) && !outcome.located;
  if (looks) last_vain_look_ = is_vain ? std::optional(frame.timestamp) : std::nullopt;
  if (outcome.gives_up) {
    EndGrowingPiece(frame.index);
    Park(*main_);
    BeginMain(EmptyLike(*main_->snapshot(), free_ids_.landmark), false);
    main_number_ = ++last_number_;
  }
  outcome = UpdateGrowingPiece(frame, std::move(outcome));
  if (mapping_ && config_.runner.mode != "live")
    passed_.Add(frame, main_->tracker().HasTracked(frame.index));
  return outcome;
}

// Whether to look for the camera in the main piece. After a failed attempt the next one waits,
// while a new piece is being made.
bool Atlas::MayLook(const Frame& frame) const {
  constexpr double kSeconds = 0.09;
  if (!growing_ || !last_vain_look_) return true;
  return frame.timestamp - *last_vain_look_ > kSeconds;
}

// Decides, after a frame was processed in the main piece, on the piece that is made while the
// camera is lost: it is begun, continued, joined with the main one, promoted or ended. Returns the
// outcome to report.
Tracker::Outcome Atlas::UpdateGrowingPiece(const Frame& frame, Tracker::Outcome outcome) {
  if (outcome.state == TrackingState::kInitializing || !mapping_) return outcome;
  const bool is_lost = IsLost(outcome);
  if (!is_lost)
    lost_since_.reset();
  else if (!lost_since_)
    lost_since_ = frame.timestamp;
  // The camera is found by points for good. While it is on probation (`outcome.located` is set) it
  // makes no keyframes in the main map and the new piece may still be joined.
  if (!is_lost && !outcome.located) EndGrowingPiece(frame.index);
  if (outcome.is_keyframe) LookInWaiting(frame, *main_);
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
  if (there.is_keyframe) LookInWaiting(frame, growing_->session());
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
  FinishAdjustment(*main_, frame_index);
  const NextIds ids = Behind(free_ids_, main_->next_ids());
  growing_.emplace(config_, EmptyLike(*main_->snapshot(), ids.landmark), ids);
  growing_->session().tracker().SetRelocalizationMode(mode_);
  if (is_shut_down_) growing_->session().Shutdown();
}

void Atlas::EndGrowingPiece(int frame_index) {
  if (!growing_) return;
  Park(growing_->session());
  growing_.reset();
  main_->SkipIds(free_ids_, frame_index);
}

// Joins the new piece with the main one; false where the transformation is not known yet.
bool Atlas::JoinGrowingPiece(int frame_index) {
  if (!growing_->Align()) return false;
  Session& found = growing_->session();
  const std::shared_ptr<const Map> map = found.Newest();  // queued commands may have moved the map
  const std::optional<Similarity> world_from_new = growing_->Align();
  if (!world_from_new) return false;
  if (!IsContinuous(*main_->Newest(), main_->tracker().trajectory(), *map,
                    found.tracker().trajectory(), *world_from_new))
    return false;
  if (!main_->Join(*map, *world_from_new, frame_index)) return false;
  if (!failure_) failure_ = found.failure();
  main_->tracker().GoOnAs(std::move(found.tracker()), world_from_new->scale);
  growing_.reset();
  Log(LogLevel::kInfo,
      fmt::format("frame {}: a map made while lost was joined with the old one", frame_index));
  return true;
}

// The piece made while the camera was lost is now larger than the main one and replaces it.
void Atlas::PromoteGrowingPiece() {
  Park(*main_);
  main_ = growing_->TakeSession();
  growing_.reset();
  main_number_ = ++last_number_;
}

// Waits for all queued commands and for the bundle adjustment in the background.
void Atlas::FinishAdjustment(Session& session, int frame_index) {
  MapCommand command;
  command.frame_index = frame_index;
  command.adopt_adjustment = true;
  session.SubmitAndWait(std::move(command));
}

// Moves the map and the trajectory of a session to the waiting pieces.
void Atlas::Park(Session& session) {
  MapCommand rest = session.tracker().TakeRest();
  // In live mode the camera does not wait for a global bundle adjustment.
  rest.adopt_adjustment = config_.runner.mode != "live";
  session.SubmitAndWait(std::move(rest));
  if (!failure_) failure_ = session.failure();
  const std::shared_ptr<const Map> map = session.snapshot();
  free_ids_ = Behind(free_ids_, session.next_ids());
  if (map->keyframes.size() == 0) return;
  session.tracker().RefineTrajectory(*map);
  const int number = &session == main_.get() ? main_number_ : ++last_number_;
  waiting_.push_back({{*map, session.tracker().trajectory()}, Relocalizer(config_), {}, number});
}

// Looks for a keyframe of a session in one of the waiting pieces, by turns, and joins that piece
// once its place is known.
void Atlas::LookInWaiting(const Frame& frame, Session& session) {
  if (waiting_.empty()) return;
  const auto waiting =
      std::next(waiting_.begin(), static_cast<std::ptrdiff_t>(turn_++ % waiting_.size()));
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const auto located = LocatedPoseOf(
      waiting->relocalizer.Find(frame, waiting->piece.map, mode_, frame.gravity_in_cam, rng),
      waiting->piece.map);
  if (!located) return;
  waiting->link.AddKeyframe(frame.index, *located);
  const auto align = [&] {
    return waiting->link.Align(*session.snapshot(), session.tracker().trajectory());
  };
  if (!align()) return;
  FinishAdjustment(session, frame.index);  // queued work may still move the map
  const auto piece_from_world = align();
  if (piece_from_world && Join(*waiting, piece_from_world->Inverse(), frame.index, session))
    waiting_.erase(waiting);
}

bool Atlas::Join(Waiting& waiting, const Similarity& world_from_piece, int frame_index,
                 Session& session) {
  const Piece& piece = waiting.piece;
  if (!IsContinuous(*session.snapshot(), session.tracker().trajectory(), piece.map,
                    piece.trajectory, world_from_piece))
    return false;
  if (!session.Join(piece.map, world_from_piece, frame_index)) return false;
  session.tracker().Adopt(piece.trajectory, world_from_piece.scale);
  const auto frame_of = [&](KeyframeId id) { return piece.map.keyframes.At(id).frame_index; };
  const std::vector<KeyframeId> ids = piece.map.keyframes.Ids();
  Log(LogLevel::kInfo,
      fmt::format("frame {}: a piece of {} keyframes, from frame {} on, was joined", frame_index,
                  ids.size(), frame_of(ids.front())));
  return true;
}

// Relocalizes keyframes of the waiting pieces in the main piece and in each other, and joins
// the pieces where this tells their place. Pairs that have not changed since they were
// compared are skipped.
void Atlas::AlignWaiting() {
  const auto mark_tried = [&](const Waiting& piece, int other, uint64_t version) {
    return tried_.insert({piece.number, piece.piece.map.keyframes.size(), other, version}).second;
  };
  const auto size_of = [](const Waiting& w) { return w.piece.map.keyframes.size(); };
  for (bool has_joined = true; std::exchange(has_joined, false);) {
    waiting_.sort([&](const Waiting& a, const Waiting& b) { return size_of(a) > size_of(b); });
    Relocalizer in_main(config_);
    for (auto waiting = waiting_.begin(); waiting != waiting_.end();) {
      const auto here = waiting++;
      if (!mark_tried(*here, main_number_, main_->snapshot()->version)) continue;
      std::optional<Similarity> world_from_piece = Align(
          here->piece, *main_->snapshot(), main_->tracker().trajectory(), mode_, config_, in_main);
      if (!world_from_piece)
        if (const auto inverse =
                here->link.Align(*main_->snapshot(), main_->tracker().trajectory()))
          world_from_piece = inverse->Inverse();
      if (!world_from_piece || !Join(*here, *world_from_piece, newest_frame_, *main_)) continue;
      waiting_.erase(here);
      has_joined = true;
    }
    for (auto into = waiting_.begin(); into != waiting_.end(); ++into)
      for (auto other = std::next(into); other != waiting_.end();) {
        const auto here = other++;
        if (!mark_tried(*here, into->number, into->piece.map.keyframes.size())) continue;
        const auto world_from_piece = Align(here->piece, into->piece.map, into->piece.trajectory,
                                            mode_, config_, into->relocalizer);
        if (!world_from_piece) continue;
        if (!IsContinuous(into->piece.map, into->piece.trajectory, here->piece.map,
                          here->piece.trajectory, *world_from_piece))
          continue;
        Rng rng(static_cast<uint64_t>(config_.runner.seed));
        JoinPiece(here->piece.map, *world_from_piece, config_, rng, into->piece.map);
        AdoptPoses(here->piece.trajectory, world_from_piece->scale, into->piece.trajectory);
        ++into->piece.map.version;
        waiting_.erase(here);
        has_joined = true;
      }
  }
}

// Whether the user needs poses in the frame of the main piece: it was loaded, or has anchors.
bool Atlas::MustStayMain() const {
  const Map& map = *main_->snapshot();
  return (is_loaded_ && !map.keyframes.empty()) || !map.anchors.empty();
}

void Atlas::PromoteLargest() {
  const auto size_of = [](const Waiting& w) { return w.piece.map.keyframes.size(); };
  const auto largest = std::ranges::max_element(waiting_, {}, size_of);
  if (largest == waiting_.end() || MustStayMain() ||
      size_of(*largest) <= main_->snapshot()->keyframes.size())
    return;
  Piece piece = std::move(largest->piece);
  const int number = largest->number;
  waiting_.erase(largest);
  Park(*main_);
  BeginMain(std::move(piece.map), true);
  is_loaded_ = false;
  main_->tracker().Adopt(piece.trajectory, 1);
  main_number_ = number;
}

void Atlas::LookBack() {
  const auto fits_a_piece = [&](const Map& map, const std::vector<FramePose>& trajectory) {
    return std::ranges::any_of(waiting_, [&](const Waiting& waiting) {
      PieceLink link;
      link.AddCommon(map, trajectory, waiting.piece.trajectory);
      return link.Align(waiting.piece.map, waiting.piece.trajectory).has_value();
    });
  };
  const int found = main_->LookBack(passed_.All(), fits_a_piece);
  passed_.Clear();
  if (found == 0) return;
  Log(LogLevel::kInfo, fmt::format("looking back, {} more frames were tracked", found));
  if (!waiting_.empty()) AlignWaiting();
}

void Atlas::Finish() {
  if (growing_) growing_->session().Newest();
  if (growing_ && !JoinGrowingPiece(newest_frame_)) EndGrowingPiece(newest_frame_);
  if (mapping_ && !failure()) {
    main_->SubmitAndWait(main_->tracker().TakeRest());
    AlignWaiting();
    PromoteLargest();
    LookBack();
  }
  main_->Finish();
  if (!mapping_ || failure()) return;
  for (Waiting& waiting : waiting_) {
    constexpr int kIterations = 20;
    Map& map = waiting.piece.map;
    if (map.keyframes.size() > 2) {
      ApplyCorrection(GlobalBundleAdjustment(map, kIterations, config_.bundle), map);
      RefitMovedObjects(config_.objects, map);
    }
    ++map.version;
  }
}

std::exception_ptr Atlas::failure() {
  if (failure_) return failure_;
  if (const std::exception_ptr failure = main_->failure()) return failure;
  return growing_ ? growing_->session().failure() : nullptr;
}

void Atlas::Shutdown() {
  is_shut_down_ = true;
  if (growing_) growing_->session().Shutdown();
  main_->Shutdown();
}

std::optional<Tracker::Outcome> Atlas::AddDetections(
    int frame_index, const std::vector<ObjectDetection>& detections) {
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
  if (mapping_ && !enabled) main_->SubmitAndWait(main_->tracker().TakeRest());
  mapping_ = enabled;
  main_->tracker().SetMapping(enabled);
  if (enabled) return;
  EndGrowingPiece(newest_frame_);
  lost_since_.reset();
}

void Atlas::ForceRelocalization() {
  main_->tracker().ForceRelocalization();
  EndGrowingPiece(newest_frame_);
  lost_since_.reset();
}

void Atlas::SetClassRelations(const ClassRelations& relations) {
  MapCommand command;
  command.frame_index = newest_frame_ + 1;
  command.classes = relations;
  for (Waiting& waiting : waiting_) oaslam::SetClassRelations(relations, waiting.piece.map);
  if (growing_) growing_->session().SubmitAndWait(command);
  main_->SubmitAndWait(std::move(command));
}

std::vector<Piece> Atlas::Others() const {
  std::vector<Piece> pieces;
  for (const Waiting& waiting : waiting_) pieces.push_back(waiting.piece);
  std::ranges::stable_sort(pieces, std::greater(),
                           [](const Piece& p) { return p.map.keyframes.size(); });
  return pieces;
}

}  // namespace oaslam
