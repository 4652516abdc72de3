#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/objects/association.h"
#include "oaslam/tracking/tracking_context.h"

namespace oaslam {

// Watches the objects that the images show: their tracks, what was seen since the mapper was last
// told, and the images whose detections are still to come.
class ObjectWatch {
 public:
  explicit ObjectWatch(const ObjectsConfig& config) : config_(config) {}

  // Keeps an image without a pose as long as its detections may come (Frame::detections_follow).
  void Await(const Frame& frame);
  // Associates the detections of an image with a pose, and returns how many mapped objects it
  // shows. Where they are still to come, keeps the pose of the image, which is the newest one.
  int Observe(const TrackedFrame& seen, const Map& map, uint32_t& next_object);
  // Removes and returns an image whose detections come now, with a pose relative to a keyframe
  // (none: `reference` is invalid). Those before it are given up. Nothing where it was given up.
  std::optional<TrackedFrame> TakeAwaited(int frame_index);
  // Removes and returns what was seen since the last call.
  std::vector<ObjectSighting> TakeSightings();

  // The object that each detection of an image shows; invalid where there is none.
  std::vector<ObjectId> ObjectsIn(const Frame& frame) const;
  // Follows a map of which all lengths were multiplied by `factor`.
  void Scale(double factor);
  // Takes what another watch, whose map was joined with this one's, saw and awaits from before.
  void AddBefore(ObjectWatch other);

 private:
  ObjectsConfig config_;
  ObjectTracks tracks_;
  std::vector<ObjectSighting> sightings_;
  std::deque<TrackedFrame> awaited_;  // ascending
};

}  // namespace oaslam
