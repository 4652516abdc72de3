#include "oaslam/map/renumbering.h"

namespace oaslam {
namespace {

class Renumberer {
 public:
  explicit Renumberer(const Renumbering& numbers) : numbers_(numbers) {}

  KeyframeId Of(KeyframeId id) const { return Shifted(id, numbers_.first.keyframe); }
  LandmarkId Of(LandmarkId id) const { return Shifted(id, numbers_.first.landmark); }
  ObjectId Of(ObjectId id) const { return Shifted(id, numbers_.first.object); }
  int Frame(int index) const { return numbers_.first_frame + index; }
  int Camera(int index) const { return numbers_.camera_of.at(static_cast<size_t>(index)); }

  Keyframe Of(Keyframe keyframe) const {
    keyframe.frame_index = Frame(keyframe.frame_index);
    keyframe.camera = Camera(keyframe.camera);
    for (LandmarkId& id : keyframe.landmarks) id = Of(id);
    for (Covisible& c : keyframe.covisible) c.keyframe = Of(c.keyframe);
    if (keyframe.motion) keyframe.motion->from = Of(keyframe.motion->from);
    return keyframe;
  }
  Landmark Of(Landmark landmark) const {
    landmark.first_keyframe = Of(landmark.first_keyframe);
    for (Observation& o : landmark.observations) o.keyframe = Of(o.keyframe);
    return landmark;
  }
  Object Of(Object object) const {
    object.last_seen_frame = Frame(object.last_seen_frame);
    for (ObjectObservation& o : object.observations) {
      o.frame_index = Frame(o.frame_index);
      o.reference = Of(o.reference);
      o.camera = Camera(o.camera);
    }
    for (LandmarkId& id : object.landmarks) id = Of(id);
    return object;
  }
  Anchor Of(Anchor anchor) const {
    anchor.keyframe = Of(anchor.keyframe);
    anchor.object = Of(anchor.object);
    return anchor;
  }
  FramePose Of(FramePose pose) const {
    pose.frame_index = Frame(pose.frame_index);
    pose.reference = Of(pose.reference);
    return pose;
  }

 private:
  template <typename Id>
  static Id Shifted(Id id, uint32_t first) {
    return id.IsValid() ? Id(id.value + first) : id;
  }

  const Renumbering& numbers_;
};

}  // namespace

Submap Renumbered(const Submap& submap, const NextIds& first) {
  Renumbering numbers{.first = first, .cameras = submap.map.cameras};
  for (int i = 0; i < std::ssize(numbers.cameras); ++i) numbers.camera_of.push_back(i);
  return Renumbered(submap, numbers);
}

Submap Renumbered(const Submap& submap, const Renumbering& numbers) {
  const Renumberer renumber(numbers);
  const Map& old = submap.map;
  Submap result;
  Map& map = result.map;
  // What is not numbered is taken over; the tables are filled below.
  map.up = old.up;
  map.up_keyframes = old.up_keyframes;
  map.version = old.version;
  map.loops_closed = old.loops_closed;
  map.is_metric = old.is_metric;
  map.unit_evidence = old.unit_evidence;
  map.classes = old.classes;
  map.cameras = numbers.cameras;
  map.next_landmark = numbers.first.landmark + old.next_landmark;
  old.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    map.keyframes.Insert(renumber.Of(id), renumber.Of(keyframe));
  });
  old.retired.ForEach([&](KeyframeId id, RetiredKeyframe retired) {
    retired.parent = renumber.Of(retired.parent);
    map.retired.Insert(renumber.Of(id), retired);
  });
  old.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    map.landmarks.Insert(renumber.Of(id), renumber.Of(landmark));
  });
  old.objects.ForEach([&](ObjectId id, const Object& object) {
    map.objects.Insert(renumber.Of(id), renumber.Of(object));
  });
  old.merged_objects.ForEach([&](ObjectId id, ObjectId into) {
    map.merged_objects.Insert(renumber.Of(id), renumber.Of(into));
  });
  for (const auto& [name, anchor] : old.anchors) map.anchors.emplace(name, renumber.Of(anchor));
  for (const FramePose& pose : submap.trajectory) result.trajectory.push_back(renumber.Of(pose));
  return result;
}

}  // namespace oaslam
