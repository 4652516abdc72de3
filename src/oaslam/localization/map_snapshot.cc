#include "oaslam/map_snapshot.h"

#include <utility>

#include "oaslam/anchors/editing.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/localization/snapshot_maker.h"

namespace oaslam {

struct OASLAM_LOCAL MapSnapshot::Content {
  std::shared_ptr<const Map> map;
  std::shared_ptr<const ClassNames> names;
  int first_frame = 0;
  uint64_t version = 0;
};

namespace {

MapSnapshot::Observation ObservationOf(const Map& map, KeyframeId id, uint32_t keypoint,
                                       LandmarkId landmark) {
  const Keyframe& keyframe = map.keyframes.At(id);
  const Keypoint& point = keyframe.features->keypoints[keypoint];
  return {id.value, landmark.value,
          Distort(map.cameras[static_cast<size_t>(keyframe.camera)], point.px.cast<double>()),
          keyframe.features->pyramid.scale[point.octave]};
}

}  // namespace

MapSnapshot SnapshotMaker::Of(std::shared_ptr<const Map> map,
                              std::shared_ptr<const ClassNames> names, int first_frame,
                              uint64_t version) {
  return MapSnapshot(std::make_shared<const MapSnapshot::Content>(
      MapSnapshot::Content{std::move(map), std::move(names), first_frame, version}));
}

MapSnapshot::MapSnapshot()
    : content_(std::make_shared<const Content>(
          Content{std::make_shared<const Map>(), std::make_shared<const ClassNames>()})) {}
MapSnapshot::MapSnapshot(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

size_t MapSnapshot::keyframe_count() const { return content_->map->keyframes.size(); }
size_t MapSnapshot::landmark_count() const { return content_->map->landmarks.size(); }
std::vector<Camera> MapSnapshot::Cameras() const { return content_->map->cameras; }
std::optional<Eigen::Vector3d> MapSnapshot::up() const { return content_->map->up; }
bool MapSnapshot::is_metric() const { return content_->map->is_metric; }
uint64_t MapSnapshot::version() const { return content_->version; }
std::vector<AnchorPose> MapSnapshot::Anchors() const { return PosesOf(*content_->map); }

std::vector<MapSnapshot::Keyframe> MapSnapshot::Keyframes() const {
  std::vector<Keyframe> found;
  found.reserve(keyframe_count());
  content_->map->keyframes.ForEach([&](KeyframeId id, const oaslam::Keyframe& k) {
    const int frame = k.frame_index - content_->first_frame;
    found.push_back({id.value, frame < 0 ? std::nullopt : std::optional(frame), k.timestamp,
                     k.camera, k.cam_from_world.Inverse()});
  });
  return found;
}

std::vector<MapSnapshot::Landmark> MapSnapshot::Landmarks() const {
  std::vector<Landmark> found;
  found.reserve(landmark_count());
  content_->map->landmarks.ForEach([&](LandmarkId id, const oaslam::Landmark& l) {
    found.push_back({id.value, l.position, static_cast<int>(l.observations.size())});
  });
  return found;
}

std::vector<MapSnapshot::Object> MapSnapshot::Objects() const {
  std::vector<Object> found;
  content_->map->objects.ForEach([&](ObjectId id, const oaslam::Object& o) {
    if (o.state != ObjectState::kMapped) return;
    found.push_back({id.value, o.category_id,
                     o.name.empty() ? NameOf(*content_->names, o.category_id) : o.name, o.ellipsoid,
                     o.covariance, o.total_observations, o.has_moved});
  });
  return found;
}

std::vector<MapSnapshot::Observation> MapSnapshot::ObservationsInKeyframe(uint32_t keyframe) const {
  std::vector<Observation> found;
  const Map& map = *content_->map;
  const oaslam::Keyframe* k = map.keyframes.Find(KeyframeId(keyframe));
  if (!k) return found;
  for (size_t i = 0; i < k->landmarks.size(); ++i)
    if (k->landmarks[i].IsValid())
      found.push_back(
          ObservationOf(map, KeyframeId(keyframe), static_cast<uint32_t>(i), k->landmarks[i]));
  return found;
}

std::vector<MapSnapshot::Observation> MapSnapshot::ObservationsOfLandmark(uint32_t landmark) const {
  std::vector<Observation> found;
  const Map& map = *content_->map;
  const oaslam::Landmark* l = map.landmarks.Find(LandmarkId(landmark));
  if (!l) return found;
  for (const oaslam::Observation& o : l->observations)
    found.push_back(ObservationOf(map, o.keyframe, o.keypoint, LandmarkId(landmark)));
  return found;
}

}  // namespace oaslam
