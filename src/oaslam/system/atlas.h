#pragma once

#include <exception>
#include <list>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/localization/relocalizer.h"
#include "oaslam/map/piece.h"
#include "oaslam/pieces/piece_link.h"
#include "oaslam/system/session.h"

namespace oaslam {

// All pieces of map of a run: the main piece, in whose frame poses are reported; a growing piece,
// in which the camera is tracked while it is lost in the main one; and waiting pieces, whose place
// in the others is not known yet. Each piece has ids of its own. Pieces are joined as soon as
// enough frames have a pose in both, by points or objects. No piece is dropped. Without mapping, no
// piece grows.
// - Once the camera has been lost for a while, a piece begins to grow. The camera is still looked
//   for in the main piece.
// - While it is found there by objects only, both are kept up until the transformation between them
//   is known (paper, section "Application to AR": resuming SLAM).
// - Once it is found there by points, both are kept up for half a second more. Then, or where it is
//   lost in the growing piece, too, that piece waits.
// - A growing piece that has become larger than the main one takes its place, while the camera is
//   lost in the main one. A main piece that was loaded, has anchors or is in metres keeps its
//   place.
class Atlas {
 public:
  // `is_loaded`: the camera is looked for in `map`, which stays the main piece unless it is empty,
  // and no initial map is made.
  Atlas(const SlamConfig& config, Map map, bool is_loaded, std::vector<Piece> others);

  // Whether the next frame must have features; without them its pose is by its motion since the map
  // was last looked for. `motion`: null as long as it is not known.
  bool NeedsFeatures(double timestamp, const FrameMotion* motion) const;
  // Tracks the next frame.
  Tracker::Outcome Process(const Frame& frame);
  // Detections of a frame that was processed before.
  std::optional<Tracker::Outcome> AddDetections(int frame_index,
                                                const std::vector<ObjectDetection>& detections);
  // Joins the pieces that can be joined, makes the largest one the main piece unless that must keep
  // its place, and waits for the last optimisation. Without mapping the map does not change.
  void Finish();
  // The exception that ended the mapping of any piece (MapPipeline); null while mapping works. The
  // caller gives no more frames then. All pieces are kept. Where the mapping of the main piece
  // still works, Finish joins the growing one with it if it can, and optimises it. It leaves the
  // waiting ones as they are.
  std::exception_ptr failure();

  void SetRelocalizationMode(RelocalizationMode mode);
  void SetMapping(bool enabled);
  void ForceRelocalization(const std::optional<Rigid3>& near);
  // Scales the main piece to metres.
  void SetMetresPerUnit(double metres);
  void SetClassRelations(const ClassRelations& relations);

  bool IsInitializing() const {
    return main_->tracker().IsInitializing() ||
           (growing_ && growing_->session->tracker().IsInitializing());
  }
  Session& main() { return *main_; }
  const Session& main() const { return *main_; }
  // The number of the main piece, in whose frame poses are reported. Each piece has its own number.
  int main_number() const { return main_number_; }
  // All pieces but the main one, by descending number of keyframes, numbered so that no two pieces
  // share an id. Waits for the mapping of the growing one.
  std::vector<Piece> Others();

 private:
  struct Growing {
    std::unique_ptr<Session> session;
    std::optional<double> lost_since{}, found_since{};  // in it; in the main one: time stamps
    PieceLink to_main{};
  };
  struct Waiting {
    Piece piece;
    int number = 0;
    Relocalizer relocalizer;
    PieceLink link{};  // poses in this piece of frames that a session tracks
    size_t keyframes() const { return piece.map.keyframes.size(); }
  };

  Tracker::Outcome UpdateGrowingPiece(const Frame& frame, Tracker::Outcome outcome);
  std::unique_ptr<Session> MakeSession(Map map, const NextIds& ids, bool has_map) const;
  void BeginGrowingPiece();
  void EndGrowingPiece();
  bool JoinGrowingPiece();
  void LookFor(const Frame& keyframe, Session& session);
  static bool Join(const Piece& piece, const Similarity& world_from_piece, Session& session);
  static bool JoinWaiting(const Piece& piece, const Similarity& world_from_piece, Session& session);
  bool JoinWaiting(const Waiting& waiting, Waiting& into) const;
  std::optional<Similarity> PlaceIn(const Map& world, const std::vector<FramePose>& trajectory,
                                    const Waiting& waiting, Relocalizer& relocalizer) const;
  void JoinAll();
  void PromoteLargest();
  void Lead(std::unique_ptr<Session> session, int number);
  void End(std::unique_ptr<Session> session);
  Piece Completed(Session& session);
  void Park(Session& session);
  bool MustStayMain() const;

  SlamConfig config_;
  RelocalizationMode mode_ = RelocalizationMode::kPointsAndObjects;
  bool mapping_ = true;
  bool is_loaded_;  // the main piece, by the user
  std::unique_ptr<Session> main_;
  std::optional<Growing> growing_;
  std::list<Waiting> waiting_;
  size_t turn_ = 0;                   // selects the waiting piece in which to look next
  std::optional<double> lost_since_;  // time stamp, seconds; with mapping
  // Time stamp in seconds of the last frame that was looked for in the main piece and not found.
  std::optional<double> last_vain_look_;
  int main_number_ = 0, last_number_ = 0;
  std::exception_ptr failure_;  // exception of a session that has ended
  std::jthread ending_;         // destroys a session; in live mode
};

}  // namespace oaslam
