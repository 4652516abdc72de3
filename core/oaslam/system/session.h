#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/system/map_pipeline.h"
#include "oaslam/tracking/tracker.h"

namespace oaslam {

// A map that is being made, and the tracker that makes it.
class Session {
 public:
  // `map_is_loaded`: the camera is looked for in `map`, and no initial map is made.
  Session(const SlamConfig& config, Map map, bool map_is_loaded);

  // Tracks the next frame and submits the command that results to the mapper.
  TrackingStep Process(const Frame& frame, const TrackingContext& context);
  // Records a frame without trying to relocalize the lost camera in it.
  TrackingStep PassOver(const Frame& frame, const TrackingContext& context) {
    return tracker_.PassOver(frame, *snapshot_, context);
  }
  // Detections of a frame that was processed before (Tracker::AddDetections).
  std::optional<TrackingStep> AddDetections(int frame_index,
                                            const std::vector<ObjectDetection>& detections,
                                            const TrackingContext& context);
  // Submits an edit, waits until the mapper has applied it, and takes the resulting map.
  void Submit(MapEdit edit);
  // As Submit, with the observations since the last command.
  void SubmitRest(MapEdit edit = {});
  // Waits until everything seen is in the map, then scales map and tracker to metres. `by_objects`:
  // the evidence for the factor by objects; nothing where the user gave the factor.
  void ScaleToMetres(double factor, const std::optional<UnitEvidence>& by_objects);
  // Adds another submap to the map and waits for the mapper. Returns false where mapping has
  // failed.
  bool Join(const Map& other, const Similarity& world_from_other);
  // Submits the remaining observations and waits for the last optimisation; a map that is only read
  // does not change.
  void Finish(MapUse use);
  // The exception that ended the mapping (MapPipeline); null while mapping works.
  std::exception_ptr failure() { return pipeline_.failure(); }

  Tracker& tracker() { return tracker_; }
  const Tracker& tracker() const { return tracker_; }
  // The map that the tracker saw last.
  const std::shared_ptr<const Map>& snapshot() const { return snapshot_; }
  // Waits for all commands submitted and returns the map that contains them.
  std::shared_ptr<const Map> Newest() { return snapshot_ = pipeline_.Newest(); }
  // As Newest, without effect on the tracker.
  std::shared_ptr<const Map> Mapped() { return pipeline_.Mapped(); }

 private:
  TrackingStep Submitted(TrackingStep step);
  void SubmitAndWait(MapCommand command);

  MapPipeline pipeline_;
  Tracker tracker_;
  std::shared_ptr<const Map> snapshot_;
};

}  // namespace oaslam
