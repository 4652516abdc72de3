#pragma once

#include <exception>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/piece.h"
#include "oaslam/system/passed_frames.h"
#include "oaslam/system/piece_link.h"
#include "oaslam/system/relocalizer.h"
#include "oaslam/system/resumption.h"
#include "oaslam/system/session.h"

namespace oaslam {

// All pieces of map of a run: the one in whose frame poses are told; the one that a lost camera
// makes meanwhile; and those that wait until they are known to lie in one of these. Pieces are
// joined, in any number, as soon as frames are found in both, by points, objects or both; none is
// thrown away.
// - The camera is followed in the main piece: there is no other one in the making.
// - It is lost there for a moment (Resumption::kPatience): another piece is begun, while each frame
// is still looked for in the main one.
// - It is found there by objects, or by points on probation: both go on, until it is known how they
// lie to each other, and they are joined.
// - It is found there for good, or lost in the new one, too: the new one waits. Where the new one
// has grown larger, the main one waits.
class Atlas {
 public:
  // `is_loaded`: the camera is looked for in `map`. No two of the pieces share an id.
  Atlas(const SlamConfig& config, Map map, bool is_loaded, std::vector<Piece> others);

  // Tracks the next frame.
  Tracker::Outcome Process(const Frame& frame);
  // Of a frame that was processed before.
  std::optional<Tracker::Outcome> AddDetections(int frame_index,
                                                const std::vector<ObjectDetection>& detections);
  // Joins what can be joined, looks back into gaps (but where the runner is live), and waits for
  // the last optimisation. Without mapping the map stays as it is.
  void Finish();
  void Shutdown();
  // What has ended the mapping of the main piece or of another one (MapPipeline); null while it
  // goes on. Pieces stay as they are from then on, and none is lost.
  std::exception_ptr failure();

  void SetRelocalizationMode(RelocalizationMode mode);
  void SetMapping(bool enabled);
  void ForceRelocalization();
  void SetClassRelations(const ClassRelations& relations);

  bool IsInitializing() const {
    return main_->tracker().IsInitializing() || (resumption_ && resumption_->IsInitializing());
  }
  Session& main() { return *main_; }
  const Session& main() const { return *main_; }
  // Of the main piece: poses are told in its frame. Another one has another number.
  int main_number() const { return main_number_; }
  // All but the main piece.
  std::vector<Piece> Others() const;

 private:
  struct Waiting {
    Piece piece;
    Relocalizer relocalizer;
    PieceLink link;  // of frames that were followed in a session, to this piece
    int number = 0;
  };

  bool MayLook(const Frame& frame) const;
  void BeginMain(Map map, bool is_loaded);
  Tracker::Outcome Resume(const Frame& frame, Tracker::Outcome outcome);
  void BeginResumption(int frame_index);
  void EndResumption(int frame_index);
  bool JoinResumption(int frame_index);
  void PromoteResumption();
  static void Settle(Session& session, int frame_index);
  void Park(Session& session);
  void LookInWaiting(const Frame& frame, Session& session);
  bool Join(Waiting& waiting, const Similarity& world_from_piece, int frame_index,
            Session& session);
  void LocateWaiting();
  void LookBack();
  void PromoteLargest();
  bool MustStayMain() const;

  SlamConfig config_;
  RelocalizationMode mode_ = RelocalizationMode::kPointsAndObjects;
  bool mapping_ = true;
  bool is_loaded_ = false;
  std::unique_ptr<Session> main_;
  std::optional<Resumption> resumption_;  // while lost
  std::optional<double> lost_since_;      // seconds
  std::optional<double> last_vain_look_;  // seconds; of a lost camera in the main piece
  std::list<Waiting> waiting_;
  NextIds free_ids_;  // behind those of all that wait
  size_t turn_ = 0;   // whose of those that wait
  PassedFrames passed_;
  int newest_frame_ = 0;
  int main_number_ = 0, last_number_ = 0;
  std::set<std::tuple<int, size_t, int, uint64_t>> tried_;  // pairs of pieces that were not joined
  bool is_shut_down_ = false;
  std::exception_ptr failure_;  // of a session that has ended
};

}  // namespace oaslam
