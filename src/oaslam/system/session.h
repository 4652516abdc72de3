#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/system/map_pipeline.h"
#include "oaslam/system/tracker.h"

namespace oaslam {

// A map that is being made, and the tracker that makes it.
class Session {
 public:
  // New ids begin at `ids`.
  Session(const SlamConfig& config, Map map, const NextIds& ids, bool map_is_loaded);

  // Tracks the next frame and submits the command that results to the mapper.
  Tracker::Outcome Process(const Frame& frame);
  // Takes note of a frame without looking for the lost camera in it.
  Tracker::Outcome PassOver(const Frame& frame) { return tracker_.PassOver(frame, *snapshot_); }
  // Detections of a frame that was processed before (Tracker::AddDetections).
  std::optional<Tracker::Outcome> AddDetections(int frame_index,
                                                const std::vector<ObjectDetection>& detections);
  // Submits an edit, waits until the mapper has applied it, and takes the resulting map.
  void Submit(MapEdit edit);
  // The same with the observations since the last command.
  void SubmitRest(MapEdit edit = {});
  // Waits until everything seen is in the map, then scales map and tracker to metres.
  void ScaleToMetres(double factor);
  // Adds another piece to the map and waits for the mapper. Returns false where mapping has failed.
  bool Join(const Map& piece, const Similarity& world_from_piece);
  // Submits the remaining observations and waits for the last optimisation, which is omitted
  // without mapping.
  void Finish();
  // The exception that ended the mapping (MapPipeline); null while mapping works.
  std::exception_ptr failure() { return pipeline_.failure(); }

  Tracker& tracker() { return tracker_; }
  const Tracker& tracker() const { return tracker_; }
  NextIds FreeIds() { return tracker_.FreeIds(*Newest()); }
  // The map that the tracker saw last.
  const std::shared_ptr<const Map>& snapshot() const { return snapshot_; }
  // Waits for all commands submitted and returns the map that contains them.
  std::shared_ptr<const Map> Newest() { return snapshot_ = pipeline_.Newest(); }
  // The same without effect on the tracker.
  std::shared_ptr<const Map> Mapped() { return pipeline_.Mapped(); }

 private:
  Tracker::Outcome Submitted(Tracker::Outcome outcome);

  MapPipeline pipeline_;
  Tracker tracker_;
  std::shared_ptr<const Map> snapshot_;
};

}  // namespace oaslam
