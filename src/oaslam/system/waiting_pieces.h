#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/localization/relocalizer.h"
#include "oaslam/map/piece.h"
#include "oaslam/pieces/piece_link.h"
#include "oaslam/system/session.h"

namespace oaslam {

// The pieces of map whose place in another one is not known yet. A piece is joined as soon as
// enough frames have a pose in both; none is dropped.
class WaitingPieces {
 public:
  explicit WaitingPieces(const SlamConfig& config) : config_(config) {}

  // `number` identifies the piece.
  void Add(Piece piece, int number);

  // Looks for a keyframe of a session in one of the pieces, in turn, and joins that piece with the
  // session's map once its place is known.
  void LookFor(const Frame& keyframe, RelocalizationMode mode, Session& session);

  // Relocalizes keyframes of the pieces in the map of a session and in each other, and joins pieces
  // where this determines their place. Skips pairs that have not changed since they were compared.
  // `frame_index`: the newest frame, for the mapper's clock.
  void JoinAll(RelocalizationMode mode, int frame_index, int session_number, Session& session);

  struct Numbered {
    Piece piece;
    int number = 0;
  };
  // Removes the piece with the most keyframes, if these are more than `keyframes`.
  std::optional<Numbered> TakeLargest(size_t keyframes);

  // Runs a last global bundle adjustment on each piece of more than two keyframes, and refits its
  // objects.
  void Optimize();

  void SetClassRelations(const ClassRelations& relations);

  // The pieces, by descending number of keyframes.
  std::vector<Piece> All() const;

 private:
  struct Waiting {
    Piece piece;
    int number = 0;
    Relocalizer relocalizer;
    PieceLink link{};  // poses in this piece of frames that a session tracks
    size_t keyframes() const { return piece.map.keyframes.size(); }
  };

  // Whether this pair has not been compared in its present state; marks it as compared.
  bool BeginComparison(const Waiting& waiting, int other, uint64_t state_of_other);
  bool JoinWithSession(RelocalizationMode mode, int frame_index, int session_number,
                       Session& session);
  bool JoinWithEachOther(RelocalizationMode mode);

  SlamConfig config_;
  std::list<Waiting> waiting_;
  size_t turn_ = 0;  // selects the piece in which to look for the next keyframe
  // Pairs of pieces, with their sizes or versions, that were compared.
  std::set<std::tuple<int, size_t, int, uint64_t>> tried_;
};

}  // namespace oaslam
