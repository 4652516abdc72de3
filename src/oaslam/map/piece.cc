#include "oaslam/map/piece.h"

#include <algorithm>

namespace oaslam {

void AdoptPoses(const std::vector<FramePose>& other, double scale, std::vector<FramePose>& own) {
  for (FramePose pose : other) {
    pose.cam_from_reference.translation *= scale;
    const auto place = std::ranges::lower_bound(own, pose.frame_index, {}, &FramePose::frame_index);
    if (place == own.end() || place->frame_index != pose.frame_index) own.insert(place, pose);
    else if (place->state == TrackingState::kObjects && pose.state != TrackingState::kObjects) *place = pose;
  }
}

Frame FrameOf(const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.keyframes.At(id);
  Frame frame{keyframe.frame_index, keyframe.timestamp, keyframe.camera, keyframe.features, {}, false, keyframe.gravity_in_cam};
  map.objects.ForEach([&](ObjectId, const Object& object) {
    for (const ObjectObservation& o : object.observations)
      if (o.frame_index == keyframe.frame_index) frame.detections.push_back({object.category_id, o.score, o.box, o.truncated});
  });
  return frame;
}

}  // namespace oaslam
