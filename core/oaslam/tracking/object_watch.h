#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/objects/association.h"
#include "oaslam/tracking/tracking_context.h"

namespace oaslam {

// Tracks the objects that the images show. Keeps their tracks, the sightings since the last command
// to the mapper, and the images whose detections are still to come.
class ObjectWatch {
 public:
  explicit ObjectWatch(const ObjectsConfig& config) : config_(config) {}

  // Keeps an image without a pose as long as its detections may come (Frame::detections_follow).
  void Await(const Frame& frame);
  // Associates the detections of an image with a pose, and returns how many mapped objects it
  // shows. Where they are still to come, keeps the pose of the image, which is the newest one.
  int Observe(const TrackedFrame& seen, const Map& map, uint32_t& next_object);
  // Removes and returns an image whose detections arrive now, with its pose relative to a keyframe;
  // `reference` is invalid where the image has no pose. Drops all awaited images before it. Returns
  // nothing where the image itself was dropped.
  std::optional<TrackedFrame> TakeAwaited(int frame_index);
  // Removes and returns what was seen since the last call.
  std::vector<ObjectSighting> TakeSightings();

  // The object that each detection of an image shows; invalid where there is none.
  std::vector<ObjectId> ObjectsIn(const Frame& frame) const;
  // Multiplies the lengths kept here by `factor`, after those of the map were.
  void Scale(double factor);
  // Adds the sightings of another watch, whose map was joined with the map of this one, and those
  // of its awaited images that come before the images awaited here.
  void AddBefore(ObjectWatch other);

 private:
  ObjectsConfig config_;
  ObjectTracks tracks_;
  std::vector<ObjectSighting> sightings_;
  std::deque<TrackedFrame> awaited_;  // ascending
};

}  // namespace oaslam
