#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/piece.h"
#include "oaslam/system/growing_piece.h"
#include "oaslam/system/session.h"
#include "oaslam/system/waiting_pieces.h"

namespace oaslam {

// All pieces of map of a run: the main piece, in whose frame poses are reported; while the camera
// is lost there, a growing piece; and waiting pieces, whose place in the others is not known yet.
// Two pieces are joined as soon as enough frames have a pose in both, by points or objects. No
// piece is dropped. Without mapping, no piece grows.
// - While the camera is tracked in the main piece, no other piece grows.
// - Once it has been lost there for longer than GrowingPiece::kPatience, a new piece begins. The
//   camera is still looked for in the main piece, after a failed attempt at most every 0.09 s.
// - While frames are found in the main piece by objects only, or by points on probation, both
//   pieces are kept up until the transformation between them is known; then they are joined.
// - Once the camera is found in the main piece and passes its probation, or is lost in the new
//   piece, too, the new piece waits.
// - A new piece that has become larger than the main one takes its place, and the main one waits,
//   while the camera is lost in the main one and tracked in the new one. A main piece that was
//   loaded, has anchors or is in metres keeps its place.
class Atlas {
 public:
  // `is_loaded`: the camera is looked for in `map`, which stays the main piece unless it is empty,
  // and no initial map is made. No two pieces share an id.
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
  // its place, tracks frames without a pose once more (not in live mode), and waits for the last
  // optimisation. Without mapping the map does not change.
  void Finish();
  // The exception that ended the mapping of any piece (MapPipeline); null while mapping works. The
  // caller gives no more frames then. All pieces are kept. Where the mapping of the main piece
  // still works, Finish joins the growing one with it if it can, and optimises it. It leaves the
  // waiting ones as they are, and tracks no frame once more.
  std::exception_ptr failure();

  void SetRelocalizationMode(RelocalizationMode mode);
  void SetMapping(bool enabled);
  void ForceRelocalization(const std::optional<Rigid3>& near);
  // Scales the main piece to metres.
  void SetMetresPerUnit(double metres);
  void SetClassRelations(const ClassRelations& relations);

  bool IsInitializing() const {
    return main_->tracker().IsInitializing() || (growing_ && growing_->IsInitializing());
  }
  Session& main() { return *main_; }
  const Session& main() const { return *main_; }
  // The number of the main piece, in whose frame poses are reported. Each piece has its own number.
  int main_number() const { return main_number_; }
  // All pieces but the main one, by descending number of keyframes. Waits for the mapping of the
  // growing one.
  std::vector<Piece> Others();

 private:
  bool MayLook(const Frame& frame) const;
  void BeginMain(Map map, bool has_map);
  Tracker::Outcome UpdateGrowingPiece(const Frame& frame, Tracker::Outcome outcome);
  void BeginGrowingPiece(int frame_index);
  void EndGrowingPiece(int frame_index);
  bool JoinGrowingPiece(int frame_index);
  void PromoteGrowingPiece();
  void End(std::unique_ptr<Session> session);
  void Park(Session& session);
  void PromoteLargest();
  bool MustStayMain() const;

  SlamConfig config_;
  RelocalizationMode mode_ = RelocalizationMode::kPointsAndObjects;
  bool mapping_ = true;
  bool is_loaded_ = false;  // the main piece, by the user
  std::unique_ptr<Session> main_;
  std::optional<GrowingPiece> growing_;  // while the camera is lost
  std::optional<double> lost_since_;     // time stamp, seconds; with mapping
  // Time stamp in seconds of the last frame that was looked for in the main piece and not found.
  std::optional<double> last_vain_look_;
  WaitingPieces waiting_;
  NextIds free_ids_;  // larger than all ids of the waiting pieces
  int newest_frame_ = 0;
  int main_number_ = 0, last_number_ = 0;
  std::exception_ptr failure_;  // exception of a session that has ended
  std::jthread ending_;         // destroys a session; in live mode
};

}  // namespace oaslam
