#include "oaslam/tracking/object_watch.h"

#include <algorithm>
#include <iterator>
#include <ranges>
#include <utility>

namespace oaslam {

void ObjectWatch::Await(const Frame& frame) {
  // Frames of some 50 KB; 4 s at 30 Hz, which bounds the memory. The newest keep their image.
  constexpr size_t kMost = 120, kWithImage = 30;
  if (frame.detections_follow) awaited_.emplace_back().frame = frame;
  if (awaited_.size() > kMost) awaited_.pop_front();
  if (awaited_.size() > kWithImage) awaited_[awaited_.size() - 1 - kWithImage].frame.image.reset();
}

int ObjectWatch::Observe(const TrackedFrame& seen, const Map& map, uint32_t& next_object) {
  if (seen.frame.detections_follow) {
    awaited_.back() = seen;
    return 0;
  }
  tracks_.next_object = next_object;
  ObjectAssociation association = AssociateObjects(seen, map, std::move(tracks_), config_);
  tracks_ = std::move(association.tracks);
  next_object = tracks_.next_object;
  int objects = 0;
  for (ObjectSighting& sighting : association.sightings) {
    const auto now = map.ResolveObject(sighting.object);
    objects += sighting.detected && now && map.objects.At(*now).state == ObjectState::kMapped;
    sightings_.push_back(std::move(sighting));
  }
  return objects;
}

std::optional<TrackedFrame> ObjectWatch::TakeAwaited(int frame_index) {
  const auto found = std::ranges::find(awaited_, frame_index,
                                       [](const TrackedFrame& image) { return image.frame.index; });
  if (found == awaited_.end()) return std::nullopt;
  TrackedFrame image = std::move(*found);
  awaited_.erase(awaited_.begin(), std::next(found));
  return image;
}

std::vector<ObjectSighting> ObjectWatch::TakeSightings() { return std::exchange(sightings_, {}); }

std::vector<ObjectId> ObjectWatch::ObjectsIn(const Frame& frame) const {
  std::vector<ObjectId> objects(frame.detections.size());
  for (const ObjectTrack& track : tracks_.open)
    for (size_t i = 0; track.last_frame == frame.index && i < objects.size(); ++i)
      if (frame.detections[i].box == track.last_box &&
          frame.detections[i].category_id == track.category_id)
        objects[i] = track.object;
  return objects;
}

void ObjectWatch::Scale(double factor) {
  for (ObjectTrack& track : tracks_.open) track.cam_from_reference.translation *= factor;
  if (tracks_.units_per_metre) *tracks_.units_per_metre *= factor;
  for (TrackedFrame& image : awaited_) image.ScaleLengths(factor);
  for (ObjectSighting& sighting : sightings_) sighting.observation.ScaleLengths(factor);
}

void ObjectWatch::AddBefore(ObjectWatch other) {
  sightings_.insert(sightings_.begin(), std::make_move_iterator(other.sightings_.begin()),
                    std::make_move_iterator(other.sightings_.end()));
  const auto is_before = [&](const TrackedFrame& image) {
    return awaited_.empty() || image.frame.index < awaited_.front().frame.index;
  };
  for (TrackedFrame& image : other.awaited_ | std::views::reverse)
    if (is_before(image)) awaited_.push_front(std::move(image));
}

}  // namespace oaslam
