#include "oaslam/system/atlas.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>
#include <vector>

#include "oaslam/map/renumbering.h"
#include "oaslam/objects/moved_objects.h"
#include "oaslam/pieces/keyframe_description.h"
#include "oaslam/pieces/keyframe_search.h"
#include "oaslam/pieces/piece_joining.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

constexpr double kPatience = 0.33;  // seconds; most losses are shorter
// Seconds in which a camera that was found again is tracked in both pieces: mostly they are joined.
constexpr double kInBoth = 0.5;

// An empty map with the same cameras and class relations, whose versions go on from there.
Map EmptyLike(const Map& map) {
  Map empty;
  empty.cameras = map.cameras;
  empty.classes = map.classes;
  empty.version = map.version;
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
    : config_(config), is_loaded_(is_loaded) {
  for (Piece& piece : others) {
    piece.map.cameras = map.cameras;
    waiting_.push_back({std::move(piece), ++last_number_, Relocalizer(config_)});
  }
  const NextIds ids = NextIdsOf(map);
  main_ = MakeSession(std::move(map), ids, is_loaded);
}

// New ids begin at `ids`. `has_map`: the camera is looked for in `map`, and no initial map is made.
std::unique_ptr<Session> Atlas::MakeSession(Map map, const NextIds& ids, bool has_map) const {
  map.next_landmark = ids.landmark;
  auto session = std::make_unique<Session>(config_, std::move(map), ids, has_map);
  session->tracker().SetRelocalizationMode(mode_);
  session->tracker().SetMapping(mapping_);
  return session;
}

bool Atlas::NeedsFeatures(double timestamp, const FrameMotion* motion) const {
  return growing_ || lost_since_ || main_->tracker().NeedsFeatures(timestamp, motion);
}

Tracker::Outcome Atlas::Process(const Frame& frame) {
  // Searches take more time than tracking: while a piece grows, each third image at 30 Hz.
  constexpr double kSeconds = 0.09;
  const bool looks = !growing_ || !last_vain_look_ || frame.timestamp - *last_vain_look_ > kSeconds;
  // What a growing piece is to be joined with makes no ids that it has, too.
  main_->tracker().SetAnotherGrows(growing_.has_value());
  if (growing_) main_->tracker().SkipObjectsOf(growing_->session->tracker());
  Tracker::Outcome outcome = looks ? main_->Process(frame) : main_->PassOver(frame);
  const bool is_vain = IsLost(outcome) && !outcome.located;
  if (looks) last_vain_look_ = is_vain ? std::optional(frame.timestamp) : std::nullopt;
  if (outcome.gives_up) {  // the main piece is too small to find the camera again
    Park(*main_);
    Lead(MakeSession(EmptyLike(*main_->snapshot()), {}, false), ++last_number_);
  }
  return mapping_ ? UpdateGrowingPiece(frame, std::move(outcome)) : outcome;
}

// After a frame was processed in the main piece: begins, continues, joins, promotes or ends the
// growing piece. Returns the outcome to report.
Tracker::Outcome Atlas::UpdateGrowingPiece(const Frame& frame, Tracker::Outcome outcome) {
  if (IsBeginning(outcome)) return outcome;
  const bool is_found = !IsLost(outcome);
  const auto note = [&](bool is_so, std::optional<double>& since) {
    if (!is_so || !since) since = is_so ? std::optional(frame.timestamp) : std::nullopt;
  };
  const auto have_passed = [&](double seconds, const std::optional<double>& since) {
    return since && frame.timestamp - *since >= seconds;
  };
  note(!is_found, lost_since_);
  if (outcome.is_keyframe) LookFor(frame, *main_);
  if (!growing_ && !have_passed(kPatience, lost_since_)) return outcome;
  if (!growing_ || (!is_found && have_passed(kPatience, growing_->lost_since))) BeginGrowingPiece();
  Session& session = *growing_->session;
  session.tracker().SkipObjectsOf(main_->tracker());
  const Tracker::Outcome there = session.Process(frame);
  note(IsLost(there), growing_->lost_since);
  note(is_found, growing_->found_since);
  if (there.gives_up || have_passed(kInBoth, growing_->found_since)) {
    EndGrowingPiece();
    return outcome;
  }
  if (outcome.located) growing_->to_main.Add(frame.index, *outcome.located);
  if (there.is_keyframe) LookFor(frame, session);
  if (!JoinGrowingPiece()) {
    const bool is_larger =
        session.snapshot()->keyframes.size() > main_->snapshot()->keyframes.size();
    if (!is_larger || is_found || IsLost(there) || MustStayMain()) return outcome;
    Park(*main_);
    Lead(std::move(growing_->session), ++last_number_);
    growing_.reset();
  }
  lost_since_.reset();
  const Tracker::Outcome now = main_->tracker().Present(*main_->snapshot());
  return now.cam_from_world ? now : outcome;
}

// Ends the piece that is being made, if there is one, and begins a new one.
void Atlas::BeginGrowingPiece() {
  EndGrowingPiece();
  main_->Submit(AdoptAdjustment{});
  growing_ = Growing{MakeSession(EmptyLike(*main_->snapshot()), main_->FreeIds(), false)};
}

// Ends the growing piece, if there is one: it waits.
void Atlas::EndGrowingPiece() {
  if (!growing_) return;
  Park(*growing_->session);
  End(std::move(growing_->session));
  growing_.reset();
}

// Joins the growing piece with the main one, in which a camera that is lost there is then tracked
// as it was in the growing one. Returns false, and leaves the pieces as they are, where the
// transformation is not known yet, the camera is lost or would jump, or the mapping of the main
// piece has failed.
bool Atlas::JoinGrowingPiece() {
  constexpr size_t kMinKeyframes = 5;  // smaller maps have hardly any parallax
  Session& session = *growing_->session;
  if (growing_->lost_since || session.snapshot()->keyframes.size() < kMinKeyframes) return false;
  const auto align = [&] {
    return growing_->to_main.Align(*session.snapshot(), session.tracker().trajectory());
  };
  // First on the map that the tracker saw, since the newest one must be waited for, and may have
  // moved.
  if (!align()) return false;
  const Piece piece{*session.Newest(), session.tracker().trajectory()};
  const std::optional<PieceAlignment> alignment = align();
  if (!alignment || !Join(piece, alignment->other_from_this, *main_)) return false;
  if (!failure_) failure_ = session.failure();
  main_->tracker().GoOnAs(std::move(session.tracker()), alignment->other_from_this.scale);
  End(std::move(growing_->session));
  growing_.reset();
  return true;
}

// Looks for a keyframe of a session in one of the waiting pieces, in turn, and joins that piece
// with the session's map once its place is known.
void Atlas::LookFor(const Frame& keyframe, Session& session) {
  if (waiting_.empty()) return;
  const auto waiting =
      std::next(waiting_.begin(), static_cast<std::ptrdiff_t>(turn_++ % waiting_.size()));
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const Map& other = waiting->piece.map;
  const Relocalization found = waiting->relocalizer.Find(keyframe, other, mode_, rng);
  if (!found.IsFound()) return;
  waiting->link.AddKeyframe(keyframe.index, found, other);
  const auto align = [&] {
    return waiting->link.Align(*session.snapshot(), session.tracker().trajectory());
  };
  if (!align()) return;
  session.Submit(AdoptAdjustment{});  // queued commands may still move the map
  const auto piece_from_world = align();
  if (!piece_from_world) return;
  if (JoinWaiting(waiting->piece, piece_from_world->other_from_this.Inverse(), session))
    waiting_.erase(waiting);
}

// Joins a piece with the map of a session; false where the camera would jump between them.
bool Atlas::Join(const Piece& piece, const Similarity& world_from_piece, Session& session) {
  if (!IsContinuous(*session.snapshot(), session.tracker().trajectory(), piece.map,
                    piece.trajectory, world_from_piece) ||
      !session.Join(piece.map, world_from_piece))
    return false;
  Log(LogLevel::kInfo,
      fmt::format("frame {}: a piece of {} keyframes, from frame {} on, was joined",
                  session.tracker().newest_frame(), piece.map.keyframes.size(),
                  piece.map.keyframes.At(piece.map.keyframes.First()).frame_index));
  return true;
}

bool Atlas::JoinWaiting(const Piece& piece, const Similarity& world_from_piece, Session& session) {
  const Piece joining = Renumbered(piece, session.FreeIds());
  if (!Join(joining, world_from_piece, session)) return false;
  session.tracker().Adopt(joining, world_from_piece.scale);
  return true;
}

bool Atlas::JoinWaiting(const Waiting& waiting, Waiting& into) const {
  auto& [map, trajectory] = into.piece;
  const auto world_from_piece = PlaceIn(map, trajectory, waiting, into.relocalizer);
  if (!world_from_piece || !IsContinuous(map, trajectory, waiting.piece.map,
                                         waiting.piece.trajectory, *world_from_piece))
    return false;
  const Piece joining = Renumbered(waiting.piece, NextIdsOf(map));
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  JoinPiece(joining.map, *world_from_piece, config_, rng, map);
  AdoptPoses(joining.trajectory, world_from_piece->scale, trajectory);
  ++map.version;
  return true;
}

// The place of a waiting piece in another map: by its keyframes that are found there, or by frames
// of the other one that were found in it.
std::optional<Similarity> Atlas::PlaceIn(const Map& world, const std::vector<FramePose>& trajectory,
                                         const Waiting& waiting, Relocalizer& relocalizer) const {
  PieceLink link;
  FindKeyframes(waiting.piece, world, mode_, {}, config_, relocalizer, link);
  if (const auto found = link.Align(waiting.piece.map, waiting.piece.trajectory))
    return found->other_from_this;
  const auto seen = waiting.link.Align(world, trajectory);
  return seen ? std::optional(seen->other_from_this.Inverse()) : std::nullopt;
}

// Joins waiting pieces with the main one and with each other.
void Atlas::JoinAll() {
  waiting_.sort([](const Waiting& a, const Waiting& b) { return a.keyframes() > b.keyframes(); });
  // After each piece anew, since more may be found in what has become larger.
  const auto join_others = [&](const auto& first, const auto& join) {
    const auto next = [&] { return std::find_if(first(), waiting_.end(), join); };
    for (auto joined = next(); joined != waiting_.end(); joined = next()) waiting_.erase(joined);
  };
  Relocalizer relocalizer(config_);
  join_others([&] { return waiting_.begin(); },
              [&](const Waiting& waiting) {
                const auto world_from_piece = PlaceIn(
                    *main_->snapshot(), main_->tracker().trajectory(), waiting, relocalizer);
                return world_from_piece && JoinWaiting(waiting.piece, *world_from_piece, *main_);
              });
  for (auto into = waiting_.begin(); into != waiting_.end(); ++into)
    join_others([&] { return std::next(into); },
                [&](const Waiting& waiting) { return JoinWaiting(waiting, *into); });
}

// Exchanges the main piece with a larger waiting one, if there is one.
void Atlas::PromoteLargest() {
  const auto largest = std::ranges::max_element(waiting_, {}, &Waiting::keyframes);
  if (MustStayMain() || largest == waiting_.end() ||
      largest->keyframes() <= main_->snapshot()->keyframes.size())
    return;
  Park(*main_);
  const NextIds ids = NextIdsOf(largest->piece.map);
  Lead(MakeSession(std::move(largest->piece.map), ids, true), largest->number);
  main_->tracker().Adopt({{}, std::move(largest->piece.trajectory)}, 1);
  waiting_.erase(largest);
}

// Makes the map of a session the main piece.
void Atlas::Lead(std::unique_ptr<Session> session, int number) {
  End(std::exchange(main_, std::move(session)));
  main_number_ = number;
  is_loaded_ = false;
}

// Destroys a session; its background adjustment takes some tenths of a second to stop. In live mode
// another thread does that, and the camera waits only where the session before is still being
// destroyed.
void Atlas::End(std::unique_ptr<Session> session) {
  if (config_.runner.mode == RunnerMode::kLive)
    ending_ = std::jthread([session = std::move(session)]() mutable { session.reset(); });
}

// A session's map, with all that its tracker has seen, and its trajectory. Keeps its failure.
Piece Atlas::Completed(Session& session) {
  session.SubmitRest(AdoptAdjustment{});  // the adjustment would end with the session
  if (!failure_) failure_ = session.failure();
  session.tracker().RefineTrajectory(*session.snapshot());
  return {*session.snapshot(), session.tracker().trajectory()};
}

// Copies a session's piece to the waiting ones, unless it is empty.
void Atlas::Park(Session& session) {
  Piece piece = Completed(session);
  if (piece.map.keyframes.empty()) return;
  DescribeKeyframes(piece.map);
  const int number = &session == main_.get() ? main_number_ : ++last_number_;
  waiting_.push_back({std::move(piece), number, Relocalizer(config_)});
}

std::vector<Piece> Atlas::Others() {
  std::vector<Piece> others;
  for (const Waiting& waiting : waiting_) others.push_back(waiting.piece);
  if (growing_) {
    const std::shared_ptr<const Map> map = growing_->session->Mapped();
    if (!map->keyframes.empty()) {
      others.push_back({*map, growing_->session->tracker().trajectory()});
      DescribeKeyframes(others.back().map);
    }
  }
  std::ranges::stable_sort(others, std::greater(),
                           [](const Piece& piece) { return piece.map.keyframes.size(); });
  NextIds free = NextIdsOf(*main_->Mapped());
  for (Piece& piece : others) {
    piece = Renumbered(piece, free);
    free = NextIdsOf(piece.map);
  }
  return others;
}

// Whether the user needs poses in the frame of the main piece: it was loaded, has anchors, or was
// scaled to metres by the user.
bool Atlas::MustStayMain() const {
  const Map& map = *main_->snapshot();
  return (is_loaded_ && !map.keyframes.empty()) || !map.anchors.empty() || map.is_metric;
}

void Atlas::Finish() {
  if (growing_) {
    growing_->session->Newest();
    if (!JoinGrowingPiece()) EndGrowingPiece();
  }
  if (mapping_ && !failure()) {
    main_->SubmitRest();
    JoinAll();
    PromoteLargest();
  }
  main_->Finish();
  if (mapping_ && !failure())
    for (Waiting& waiting : waiting_) OptimizePiece(config_, waiting.piece.map);
}

std::exception_ptr Atlas::failure() {
  if (failure_) return failure_;
  if (const std::exception_ptr failure = main_->failure()) return failure;
  return growing_ ? growing_->session->failure() : nullptr;
}

std::optional<Tracker::Outcome> Atlas::AddDetections(
    int frame_index, const std::vector<ObjectDetection>& detections) {
  // Both pieces may make objects of them, with different ids.
  if (growing_) main_->tracker().SkipObjectsOf(growing_->session->tracker());
  std::optional<Tracker::Outcome> outcome = main_->AddDetections(frame_index, detections);
  if (outcome && outcome->state == TrackingState::kRelocalized) {
    lost_since_.reset();
    last_vain_look_.reset();
  }
  if (!growing_) return outcome;
  growing_->session->tracker().SkipObjectsOf(main_->tracker());
  growing_->session->AddDetections(frame_index, detections);
  if (outcome && outcome->located) growing_->to_main.Add(frame_index, *outcome->located);
  return outcome;
}

void Atlas::SetRelocalizationMode(RelocalizationMode mode) {
  mode_ = mode;
  main_->tracker().SetRelocalizationMode(mode);
  if (growing_) growing_->session->tracker().SetRelocalizationMode(mode);
}

void Atlas::SetMapping(bool enabled) {
  if (mapping_ == enabled) return;
  if (!enabled) main_->SubmitRest();
  EndGrowingPiece();
  lost_since_.reset();
  mapping_ = enabled;
  main_->tracker().SetMapping(enabled);
}

void Atlas::SetMetresPerUnit(double metres) {
  EndGrowingPiece();
  main_->ScaleToMetres(metres);
}

void Atlas::ForceRelocalization(const std::optional<Rigid3>& near) {
  main_->tracker().ForceRelocalization(near);
  EndGrowingPiece();
  lost_since_.reset();
}

void Atlas::SetClassRelations(const ClassRelations& relations) {
  for (Waiting& waiting : waiting_) oaslam::SetClassRelations(relations, waiting.piece.map);
  if (growing_) growing_->session->Submit(relations);
  main_->Submit(relations);
}

}  // namespace oaslam
