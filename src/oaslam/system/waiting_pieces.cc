#include "oaslam/system/waiting_pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "oaslam/objects/moved_objects.h"
#include "oaslam/pieces/keyframe_search.h"
#include "oaslam/pieces/piece_joining.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Estimates world_from_piece from frames that have a pose in both maps, and by relocalizing
// keyframes of the piece in the other map. Returns nothing where these do not determine it.
std::optional<Similarity> Align(const Piece& piece, const Map& world,
                                const std::vector<FramePose>& trajectory, RelocalizationMode mode,
                                const SlamConfig& config, Relocalizer& relocalizer) {
  PieceLink link;
  link.AddCommon(world, trajectory, piece.trajectory);
  if (!link.CanAlign(piece.map.keyframes.size())) return std::nullopt;
  FindKeyframes(piece, world, mode, {}, config, relocalizer, link);
  const std::optional<PieceAlignment> alignment = link.Align(piece.map, piece.trajectory);
  return alignment ? std::optional(alignment->other_from_this) : std::nullopt;
}

// Joins a piece with the map of a session; false where the camera would jump between them.
bool Join(const Piece& piece, const Similarity& world_from_piece, int frame_index,
          Session& session) {
  if (!IsContinuous(*session.snapshot(), session.tracker().trajectory(), piece.map,
                    piece.trajectory, world_from_piece))
    return false;
  if (!session.Join(piece.map, world_from_piece, frame_index)) return false;
  session.tracker().Adopt(piece.trajectory, world_from_piece.scale);
  const std::vector<KeyframeId> ids = piece.map.keyframes.Ids();
  Log(LogLevel::kInfo,
      fmt::format("frame {}: a piece of {} keyframes, from frame {} on, was joined", frame_index,
                  ids.size(), piece.map.keyframes.At(ids.front()).frame_index));
  return true;
}

}  // namespace

void WaitingPieces::Add(Piece piece, int number) {
  waiting_.push_back({std::move(piece), number, Relocalizer(config_)});
}

void WaitingPieces::LookFor(const Frame& keyframe, RelocalizationMode mode, Session& session) {
  if (waiting_.empty()) return;
  const auto waiting =
      std::next(waiting_.begin(), static_cast<std::ptrdiff_t>(turn_++ % waiting_.size()));
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const auto located = LocatedPoseOf(
      waiting->relocalizer.Find(keyframe, waiting->piece.map, mode, keyframe.gravity_in_cam, rng),
      waiting->piece.map);
  if (!located) return;
  waiting->link.AddKeyframe(keyframe.index, *located);
  const auto align = [&] {
    return waiting->link.Align(*session.snapshot(), session.tracker().trajectory());
  };
  if (!align()) return;
  session.FinishAdjustment(keyframe.index);  // queued commands may still move the map
  const auto piece_from_world = align();
  if (piece_from_world &&
      Join(waiting->piece, piece_from_world->other_from_this.Inverse(), keyframe.index, session))
    waiting_.erase(waiting);
}

void WaitingPieces::JoinAll(RelocalizationMode mode, int frame_index, int session_number,
                            Session& session) {
  for (bool has_joined = true; has_joined;) {
    waiting_.sort([](const Waiting& a, const Waiting& b) { return a.keyframes() > b.keyframes(); });
    const bool with_session = JoinWithSession(mode, frame_index, session_number, session);
    const bool with_each_other = JoinWithEachOther(mode);
    has_joined = with_session || with_each_other;
  }
}

bool WaitingPieces::BeginComparison(const Waiting& waiting, int other, uint64_t state_of_other) {
  return tried_.insert({waiting.number, waiting.keyframes(), other, state_of_other}).second;
}

bool WaitingPieces::JoinWithSession(RelocalizationMode mode, int frame_index, int session_number,
                                    Session& session) {
  bool has_joined = false;
  Relocalizer relocalizer(config_);
  for (auto waiting = waiting_.begin(); waiting != waiting_.end();) {
    const auto here = waiting++;
    if (!BeginComparison(*here, session_number, session.snapshot()->version)) continue;
    std::optional<Similarity> world_from_piece =
        Align(here->piece, *session.snapshot(), session.tracker().trajectory(), mode, config_,
              relocalizer);
    if (!world_from_piece)
      if (const auto inverse =
              here->link.Align(*session.snapshot(), session.tracker().trajectory()))
        world_from_piece = inverse->other_from_this.Inverse();
    if (!world_from_piece || !Join(here->piece, *world_from_piece, frame_index, session)) continue;
    waiting_.erase(here);
    has_joined = true;
  }
  return has_joined;
}

bool WaitingPieces::JoinWithEachOther(RelocalizationMode mode) {
  bool has_joined = false;
  for (auto into = waiting_.begin(); into != waiting_.end(); ++into)
    for (auto other = std::next(into); other != waiting_.end();) {
      const auto here = other++;
      if (!BeginComparison(*here, into->number, into->keyframes())) continue;
      const auto world_from_piece = Align(here->piece, into->piece.map, into->piece.trajectory,
                                          mode, config_, into->relocalizer);
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
  return has_joined;
}

std::optional<WaitingPieces::Numbered> WaitingPieces::TakeLargest(size_t keyframes) {
  const auto largest = std::ranges::max_element(waiting_, {}, &Waiting::keyframes);
  if (largest == waiting_.end() || largest->keyframes() <= keyframes) return std::nullopt;
  Numbered taken{std::move(largest->piece), largest->number};
  waiting_.erase(largest);
  return taken;
}

void WaitingPieces::Optimize() {
  for (Waiting& waiting : waiting_) OptimizePiece(config_, waiting.piece.map);
}

void WaitingPieces::SetClassRelations(const ClassRelations& relations) {
  for (Waiting& waiting : waiting_) oaslam::SetClassRelations(relations, waiting.piece.map);
}

std::vector<Piece> WaitingPieces::All() const {
  std::vector<Piece> pieces;
  for (const Waiting& waiting : waiting_) pieces.push_back(waiting.piece);
  std::ranges::stable_sort(pieces, std::greater(),
                           [](const Piece& p) { return p.map.keyframes.size(); });
  return pieces;
}

}  // namespace oaslam
