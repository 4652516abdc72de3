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

// The pieces of map that wait until their place in another one is known. A piece is joined as soon
// as enough frames have a pose in both; none is thrown away.
class WaitingPieces {
 public:
  explicit WaitingPieces(const SlamConfig& config) : config_(config) {}

  // `number`: the piece's own, by which it is told from others.
  void Add(Piece piece, int number);

  // Looks for a keyframe of a session in one of the pieces, by turns, and joins that piece with the
  // session's map once its place is known.
  void LookFor(const Frame& keyframe, RelocalizationMode mode, Session& session);

  // Relocalizes keyframes of the pieces in the map of a session, whose number is given, and in each
  // other, and joins the pieces where this tells their place. Pairs that have not changed since
  // they were compared are skipped. `frame_index`: the newest frame, for the mapper's clock.
  void JoinAll(RelocalizationMode mode, int frame_index, int session_number, Session& session);

  // Whether a map agrees with one of the pieces on frames that have a pose in both.
  bool Confirm(const Map& map, const std::vector<FramePose>& trajectory) const;

  struct Numbered {
    Piece piece;
    int number = 0;
  };
  // Removes the piece with the most keyframes, if these are more than `keyframes`.
  std::optional<Numbered> TakeLargest(size_t keyframes);

  // A last global bundle adjustment of each piece of more than two keyframes; objects follow.
  void Optimize();

  void SetClassRelations(const ClassRelations& relations);

  // The pieces, that with the most keyframes first.
  std::vector<Piece> All() const;

 private:
  struct Waiting {
    Piece piece;
    int number = 0;
    Relocalizer relocalizer;
    PieceLink link{};  // poses in this piece of frames that a session tracks
    size_t keyframes() const { return piece.map.keyframes.size(); }
  };

  // Whether this pair was not compared before in its present state; from now on it counts as
  // compared.
  bool BeginComparison(const Waiting& waiting, int other, uint64_t state_of_other);
  bool JoinWithSession(RelocalizationMode mode, int frame_index, int session_number,
                       Session& session);
  bool JoinWithEachOther(RelocalizationMode mode);

  SlamConfig config_;
  std::list<Waiting> waiting_;
  size_t turn_ = 0;  // counts which piece the next keyframe is looked for in
  // Pairs of pieces, with their sizes or versions, that were compared.
  std::set<std::tuple<int, size_t, int, uint64_t>> tried_;
};

}  // namespace oaslam
