#include "oaslam/objects/known_poses.h"

#include <map>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/objects/association.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/objects/object_model.h"

namespace oaslam {
namespace {

double MeanIoU(const Map& map,
               const std::vector<std::pair<ObjectId, ObjectObservation>>& observations) {
  std::map<ObjectId, std::vector<ObjectObservation>> by_object;
  for (const auto& [id, observation] : observations)
    if (const auto object = map.ResolveObject(id)) by_object[*object].push_back(observation);
  double sum = 0;
  int count = 0;
  for (const auto& [id, own] : by_object) {
    const Object& object = map.objects.At(id);
    if (object.state != ObjectState::kMapped) continue;
    sum += MeasureOverlap(object.ellipsoid, ViewsOf(map, own), 0).mean_iou;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

KnownPoseMap MapObjectsFromKnownPoses(std::span<const PosedDetections> frames, const Camera& camera,
                                      const ObjectsConfig& config, const ClassRelations& classes,
                                      const std::function<void(int)>& progress) {
  KnownPoseMap result;
  Map& map = result.map;
  map.cameras = {camera};
  map.classes = classes;
  auto no_features = std::make_shared<Features>();
  no_features->bounds = IdealImageBounds(camera);
  no_features->BuildGrid();
  ObjectTracks tracks;
  std::vector<std::pair<ObjectId, ObjectObservation>> observations;
  const auto shared_camera = std::make_shared<const Camera>(camera);
  for (size_t i = 0; i < frames.size(); ++i) {
    const PosedDetections& frame = frames[i];
    const KeyframeId id(static_cast<uint32_t>(i));
    map.keyframes.Insert(
        id, {frame.frame_index, frame.timestamp, 0, frame.cam_from_world, no_features, {}, {}});
    TrackedFrame tracked;
    tracked.frame = {frame.frame_index, frame.timestamp, shared_camera, no_features,
                     frame.detections};
    tracked.cam_from_world = frame.cam_from_world;
    tracked.reference = id;
    ObjectAssociation association = AssociateObjects(tracked, map, std::move(tracks), config);
    tracks = std::move(association.tracks);
    for (const ObjectSighting& s : association.sightings)
      if (s.detected) observations.emplace_back(s.object, s.observation);
    UpdateObjects(map, association.sightings, {frame.frame_index, frame.timestamp}, config);
    if (progress) progress(static_cast<int>(i) + 1);
  }
  result.mean_iou = MeanIoU(map, observations);
  return result;
}

}  // namespace oaslam
