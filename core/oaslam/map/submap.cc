#include "oaslam/map/submap.h"

#include <algorithm>
#include <memory>

namespace oaslam {

void AdoptPoses(const std::vector<FramePose>& other, double scale, std::vector<FramePose>& own) {
  const size_t own_count = own.size();
  for (FramePose pose : other) {
    pose.cam_from_reference.translation *= scale;
    const auto own_end = own.begin() + static_cast<std::ptrdiff_t>(own_count);
    const auto place = std::lower_bound(
        own.begin(), own_end, pose,
        [](const FramePose& a, const FramePose& b) { return a.frame_index < b.frame_index; });
    if (place == own_end || place->frame_index != pose.frame_index)
      own.push_back(pose);
    else if (place->state == TrackingState::kObjects && pose.state != TrackingState::kObjects)
      *place = pose;
  }
  std::ranges::inplace_merge(own, own.begin() + static_cast<std::ptrdiff_t>(own_count), {},
                             &FramePose::frame_index);
}

void ScaleToMetres(double metres_per_unit, const std::optional<UnitEvidence>& by_objects, Map& map,
                   std::vector<FramePose>& trajectory) {
  map.Scale(metres_per_unit);
  map.is_metric = true;
  map.unit_evidence = by_objects;
  for (FramePose& pose : trajectory) pose.cam_from_reference.translation *= metres_per_unit;
}

void FollowUnits(const Map& map, std::vector<FramePose>& poses) {
  for (FramePose& pose : poses) {
    if (const Keyframe* keyframe = map.keyframes.Find(pose.reference))
      pose.cam_from_reference.translation *= keyframe->unit;
    else if (const RetiredKeyframe* retired = map.retired.Find(pose.reference))
      pose.cam_from_reference.translation *= retired->unit;
  }
}

Frame FrameOf(const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.keyframes.At(id);
  Frame frame{keyframe.frame_index,
              keyframe.timestamp,
              std::make_shared<const Camera>(map.cameras[static_cast<size_t>(keyframe.camera)]),
              keyframe.features,
              {},
              false,
              keyframe.gravity_in_cam};
  frame.image = keyframe.image;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    for (const ObjectObservation& o : object.observations)
      if (o.frame_index == keyframe.frame_index)
        frame.detections.push_back(
            {object.category_id, o.score, o.box, o.truncated, object.shares});
  });
  return frame;
}

}  // namespace oaslam
