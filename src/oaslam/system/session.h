#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/system/map_pipeline.h"
#include "oaslam/system/tracker.h"

namespace oaslam {

// A map in the making, and the tracker that makes it.
class Session {
 public:
  Session(const SlamConfig& config, Map map, const NextIds& ids, bool map_is_loaded);

  // Tracks the next frame and hands the mapper what follows from it.
  Tracker::Outcome Process(const Frame& frame);
  // A frame in which a lost camera is not looked for.
  Tracker::Outcome PassOver(const Frame& frame) { return tracker_.PassOver(frame); }
  // Of a frame that was processed before.
  std::optional<Tracker::Outcome> AddDetections(int frame_index,
                                                const std::vector<ObjectDetection>& detections) {
    return tracker_.AddDetections(frame_index, detections, *snapshot_);
  }
  // Submits, and takes the map that holds it.
  void SubmitAndWait(MapCommand command);
  // Adds what is seen of another piece; returns after the mapper has done it. False where mapping
  // has ended before.
  bool Join(const Map& piece, const Similarity& world_from_piece, int frame_index);
  // Whether something else speaks for a way that was followed, by the map and the trajectory that
  // it made.
  using Confirmation = std::function<bool(const Map&, const std::vector<FramePose>&)>;
  // Follows the camera once more, and maps, where it was not followed when these frames came, from
  // both sides: first with as much evidence as ever, then with less, if the way agrees with what is
  // known at its end or is confirmed. `frames` in order, perhaps with holes. Returns how many got a
  // pose.
  int LookBack(const std::vector<Frame>& frames, const Confirmation& is_confirmed);
  // Hands over what is left, and waits for the last optimisation; without mapping there is none.
  void Finish();
  void Shutdown() { pipeline_.Shutdown(); }
  // What has ended the mapping (MapPipeline); null while it goes on.
  std::exception_ptr failure() { return failure_ ? failure_ : pipeline_.failure(); }

  Tracker& tracker() { return tracker_; }
  const Tracker& tracker() const { return tracker_; }
  const std::shared_ptr<const Map>& snapshot() const {
    return snapshot_;
  }  // as the tracker saw it last
  // Ids from here on are free.
  NextIds next_ids();
  // To be free of ids that other pieces took meanwhile.
  void SkipIds(const NextIds& ids, int frame_index);
  // With all that was submitted.
  std::shared_ptr<const Map> Newest() { return snapshot_ = pipeline_.Newest(); }

 private:
  using Way = std::vector<const Frame*>;
  int FollowAlong(const Way& way, const Confirmation* is_confirmed);
  int Extend(const Way& way, size_t first, size_t last, bool on_thin_evidence);
  bool AgreesWith(const Frame& frame) const;

  SlamConfig config_;
  MapPipeline pipeline_;
  Tracker tracker_;
  std::shared_ptr<const Map> snapshot_;
  std::exception_ptr failure_;  // of a copy of the map that was mapped to look back
};

}  // namespace oaslam
