#include "oaslam/map_snapshot.h"

#include <atomic>
#include <map>
#include <utility>

#include "oaslam/anchors/editing.h"
#include "oaslam/anchors/ray_cast.h"
#include "oaslam/error.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/objects/scale_estimate.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/storage/map_bytes.h"

namespace oaslam {
namespace {

// TrackingResult::frame; nothing for an image of a file.
std::optional<int> FrameOf(const MapSnapshot::Content& content, int frame_index) {
  const int frame = frame_index - content.first_frame;
  return frame < 0 ? std::nullopt : std::optional(frame);
}

MapSnapshot::Keyframe ElementOf(const MapSnapshot::Content& content, KeyframeId id,
                                const Keyframe& k) {
  return {id, FrameOf(content, k.frame_index), k.timestamp, k.camera, k.cam_from_world.Inverse()};
}

MapSnapshot::Landmark ElementOf(const MapSnapshot::Content&, LandmarkId id, const Landmark& l) {
  return {id, l.position, static_cast<int>(l.observations.size())};
}

MapSnapshot::Object ElementOf(const MapSnapshot::Content& content, ObjectId id, const Object& o) {
  return {
      id,          o.category_id, o.name.empty() ? NameOf(*content.names, o.category_id) : o.name,
      o.ellipsoid, o.covariance,  o.total_observations,
      o.has_moved};
}

bool IsShown(const Keyframe&) { return true; }
bool IsShown(const Landmark&) { return true; }
bool IsShown(const Object& o) { return o.state == ObjectState::kMapped; }

template <typename Element, typename Id, typename T>
std::optional<Element> FindElement(const MapSnapshot::Content& content, const Table<Id, T>& table,
                                   Id id) {
  const T* value = table.Find(id);
  if (!value || !IsShown(*value)) return std::nullopt;
  return ElementOf(content, id, *value);
}

template <typename Element, typename Id, typename T>
std::optional<Element> NextElement(const MapSnapshot::Content& content, const Table<Id, T>& table,
                                   const Element* last) {
  const auto from = [&](Id id) { return table.FirstFrom(id); };
  for (Id id = from(Id(last ? last->id.value + 1 : 0)); id.IsValid(); id = from(Id(id.value + 1)))
    if (auto found = FindElement<Element>(content, table, id)) return found;
  return std::nullopt;
}

MapSnapshot::Observation ObservationOf(const Map& map, KeyframeId id, uint32_t keypoint,
                                       LandmarkId landmark) {
  const Keyframe& keyframe = map.keyframes.At(id);
  const Keypoint& point = keyframe.features->keypoints[keypoint];
  return {id, landmark, static_cast<int>(keypoint),
          Distort(map.cameras[static_cast<size_t>(keyframe.camera)], point.px.cast<double>()),
          keyframe.features->pyramid.scale[point.octave]};
}

}  // namespace

WorldId NewWorld() {
  static std::atomic<uint32_t> worlds = 0;
  return WorldId(worlds++);
}

SavedMap SavedMapOf(const MapSnapshot& snapshot) {
  const MapSnapshot::Content& content = *snapshot.content();
  if (content.saved) return *content.saved;
  return {*content.map, {}, *content.names};
}

MapSnapshot SnapshotOf(SavedMap content, WorldId world, uint64_t version) {
  const auto saved = std::make_shared<const SavedMap>(std::move(content));
  return MapSnapshot(std::make_shared<const MapSnapshot::Content>(
      MapSnapshot::Content{{saved, &saved->map},
                           {saved, &saved->class_names},
                           FramesOf(*saved),
                           version,
                           world,
                           saved}));
}

MapSnapshot Indexed(const MapSnapshot& snapshot) {
  if (snapshot.content()->index) return snapshot;
  MapSnapshot::Content content = *snapshot.content();
  content.index = std::make_shared<const LandmarkIndex>(*content.map);
  return MapSnapshot(std::make_shared<const MapSnapshot::Content>(std::move(content)));
}

MapSnapshot SnapshotSeries::Of(const std::shared_ptr<const Map>& map,
                               const std::shared_ptr<const ClassNames>& names, int first_frame,
                               WorldId world) {
  const MapSnapshot::Content& last = *newest_.content();
  if (map != last.map || names != last.names || world != last.world)
    newest_ = MapSnapshot(std::make_shared<const MapSnapshot::Content>(
        MapSnapshot::Content{map, names, first_frame, ++version_, world}));
  return newest_;
}

MapSnapshot::MapSnapshot()
    : content_(std::make_shared<const Content>(
          Content{std::make_shared<const Map>(), std::make_shared<const ClassNames>()})) {}

MapSnapshot MapSnapshot::Load(const std::string& path, int submap) {
  SavedMap saved = LoadMap(path);
  LeadWithSubmap(path, submap, saved);
  return SnapshotOf(std::move(saved), NewWorld(), 1);
}

void MapSnapshot::Save(const std::string& path) const { SaveMap(path, SavedMapOf(*this)); }

MapSnapshot MapSnapshot::FromBytes(std::string_view bytes, int submap) {
  SavedMap saved = MapOfBytes(bytes);
  LeadWithSubmap("map", submap, saved);
  return SnapshotOf(std::move(saved), NewWorld(), 1);
}

std::string MapSnapshot::ToBytes() const { return BytesOf(SavedMapOf(*this)); }

const std::vector<Camera>& MapSnapshot::Cameras() const { return content_->map->cameras; }
const std::map<int, std::string>& MapSnapshot::CategoryNames() const { return *content_->names; }
int MapSnapshot::submaps() const {
  return content_->saved ? 1 + static_cast<int>(content_->saved->submaps.size()) : 1;
}
WorldId MapSnapshot::world() const { return content_->world; }
std::optional<Eigen::Vector3d> MapSnapshot::up() const { return content_->map->up; }
bool MapSnapshot::is_up_measured() const {
  return content_->map->up && content_->map->up_keyframes > 0;
}
bool MapSnapshot::is_metric() const { return content_->map->is_metric; }
double MapSnapshot::unit_sigma() const {
  const auto& by_objects = content_->map->unit_evidence;
  return by_objects ? by_objects->relative_sigma : 0;
}
ScaleEstimate MapSnapshot::EstimateScale() const {
  return oaslam::EstimateScale(*content_->map, *content_->names);
}
uint64_t MapSnapshot::version() const { return content_->version; }
std::vector<AnchorPose> MapSnapshot::Anchors() const { return PosesOf(*content_->map); }

std::vector<StampedPose> MapSnapshot::Trajectory() const {
  const Map& map = *content_->map;
  return content_->saved ? WorldPoses(map, content_->saved->trajectory) : KeyframePoses(map);
}

std::optional<MapSnapshot::Keyframe> MapSnapshot::Find(KeyframeId id) const {
  return FindElement<Keyframe>(*content_, content_->map->keyframes, id);
}
std::optional<MapSnapshot::Landmark> MapSnapshot::Find(LandmarkId id) const {
  return FindElement<Landmark>(*content_, content_->map->landmarks, id);
}
std::optional<MapSnapshot::Object> MapSnapshot::Find(ObjectId id) const {
  return FindElement<Object>(*content_, content_->map->objects, id);
}

std::optional<MapSnapshot::Keyframe> MapSnapshot::Next(const Content& content,
                                                       const Keyframe* last) {
  return NextElement(content, content.map->keyframes, last);
}
std::optional<MapSnapshot::Landmark> MapSnapshot::Next(const Content& content,
                                                       const Landmark* last) {
  return NextElement(content, content.map->landmarks, last);
}
std::optional<MapSnapshot::Object> MapSnapshot::Next(const Content& content, const Object* last) {
  return NextElement(content, content.map->objects, last);
}

size_t MapSnapshot::Count(const Content& content, const Keyframe*) {
  return content.map->keyframes.size();
}
size_t MapSnapshot::Count(const Content& content, const Landmark*) {
  return content.map->landmarks.size();
}
size_t MapSnapshot::Count(const Content& content, const Object*) {
  return static_cast<size_t>(content.map->CountMappedObjects());
}

std::vector<MapSnapshot::Observation> MapSnapshot::Observations(KeyframeId id) const {
  std::vector<Observation> found;
  const Map& map = *content_->map;
  const oaslam::Keyframe* k = map.keyframes.Find(id);
  if (!k) return found;
  for (size_t i = 0; i < k->landmarks.size(); ++i)
    if (k->landmarks[i].IsValid())
      found.push_back(ObservationOf(map, id, static_cast<uint32_t>(i), k->landmarks[i]));
  return found;
}

std::vector<MapSnapshot::Observation> MapSnapshot::Observations(LandmarkId id) const {
  std::vector<Observation> found;
  const Map& map = *content_->map;
  const oaslam::Landmark* l = map.landmarks.Find(id);
  if (!l) return found;
  for (const oaslam::Observation& o : l->observations)
    found.push_back(ObservationOf(map, o.keyframe, o.keypoint, id));
  return found;
}

std::vector<MapSnapshot::Sighting> MapSnapshot::Observations(ObjectId id) const {
  std::vector<Sighting> found;
  const Map& map = *content_->map;
  const oaslam::Object* object = map.objects.Find(id);
  if (!object || !IsShown(*object)) return found;
  std::map<int, KeyframeId> keyframes;  // by frame
  map.keyframes.ForEach([&](KeyframeId keyframe, const oaslam::Keyframe& k) {
    keyframes.emplace(k.frame_index, keyframe);
  });
  for (const ObjectObservation& o : object->observations) {
    const std::optional<Rigid3> reference = map.ResolvePose(o.reference);
    if (!reference) continue;
    const auto keyframe = keyframes.find(o.frame_index);
    found.push_back({keyframe == keyframes.end() ? std::nullopt : std::optional(keyframe->second),
                     FrameOf(*content_, o.frame_index),
                     (o.cam_from_reference * *reference).Inverse(), o.box, o.score});
  }
  return found;
}

std::vector<RayHit> MapSnapshot::Cast(const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction) const {
  if (!origin.allFinite() || !direction.allFinite() || !(direction.norm() > 0))
    throw InputError("ray: must be finite, and its direction not zero");
  return CastRay(*content_->map, origin, direction);
}

std::span<const MapSnapshot::Descriptor> MapSnapshot::Descriptors(KeyframeId id) const {
  const oaslam::Keyframe* k = content_->map->keyframes.Find(id);
  return k ? std::span<const Descriptor>(k->features->descriptors) : std::span<const Descriptor>();
}

}  // namespace oaslam
