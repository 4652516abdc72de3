#include "oaslam/objects/object_mapper.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "oaslam/map/landmark_sets.h"
#include "oaslam/objects/description.h"
#include "oaslam/objects/life_cycle.h"
#include "oaslam/objects/moved_objects.h"
#include "oaslam/objects/object_merging.h"
#include "oaslam/objects/object_model.h"
#include "oaslam/objects/occlusion.h"
#include "oaslam/objects/own_landmarks.h"
#include "oaslam/objects/presence.h"
#include "oaslam/objects/sight_lines.h"
#include "oaslam/objects/upright.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// An object whose detections do not agree is dropped after this many times
// objects.min_observations: more views would hardly change that.
constexpr int kNeverConsistent = 3;
// If the overlap changes by more than this without new observations, the object's keyframes have
// moved. A fit costs time; a smaller change would not alter the object noticeably.
constexpr double kMovedIoU = 0.02;

// Updates the ratio of detections to views. The number of views is not stored: it is
// total_observations / rate.
void CountView(bool detected, Object& object) {
  const double hits = std::max(object.total_observations, 1), views = hits / object.detection_rate;
  object.detection_rate = std::clamp((hits + detected) / (views + 1), 0.02, 1.0);
  object.misses = detected ? 0 : object.misses + 1;
}

// Updates the mean label shares over all detections, of which `total_observations` were counted
// before.
void CountLabels(const ObjectSighting& sighting, Object& object) {
  object.shares = MeanShares(LabelsOf(object), object.total_observations, LabelsOf(sighting), 1);
  object.category_id = CommonestLabel(LabelsOf(object));
}

// Adds a sighting to its object. Returns the object if it must be refitted; nothing if it was not
// detected or has been dropped.
std::optional<ObjectId> Receive(const ObjectSighting& sighting, Map& map) {
  // A sighting may wait while its class is declared movable (SetClassRelations).
  if (sighting.is_new && !map.classes.IsMovable(sighting.category_id) &&
      !map.objects.Contains(sighting.object) && !map.merged_objects.Contains(sighting.object)) {
    Object object;
    object.category_id = sighting.category_id;
    object.shares = sighting.shares;
    map.objects.Insert(sighting.object, std::move(object));
  }
  const std::optional<ObjectId> id = map.ResolveObject(sighting.object);
  if (!id) return std::nullopt;
  Object& object = map.objects.MutableAt(*id);
  if (object.state == ObjectState::kMapped) {
    WeighPlace(sighting.place, sighting.interval_s, object);
    CountView(sighting.detected, object);
  } else if (sighting.detected) {
    object.absence = 0;  // it is detected again
  }
  if (!sighting.detected) return std::nullopt;
  auto& observations = object.observations;
  const auto place = std::ranges::upper_bound(observations, sighting.observation.frame_index, {},
                                              &ObjectObservation::frame_index);
  observations.insert(place, sighting.observation);
  CountLabels(sighting, object);
  ++object.total_observations;
  object.evidence += sighting.observation.weight;
  object.last_seen_frame = std::max(object.last_seen_frame, sighting.observation.frame_index);
  object.last_seen_time =
      std::max(object.last_seen_time.value_or(sighting.timestamp), sighting.timestamp);
  AddVotes(sighting.landmarks, std::vector<uint16_t>(sighting.landmarks.size(), 1), object);
  return id;
}

// The observations as views, with hidden edges marked; the paper's model treats
// all boxes as complete.
std::vector<BoxView> VisibleViews(const Map& map, std::span<const ObjectPlace> places, ObjectId id,
                                  const Object& object, const ObjectsConfig& config) {
  std::vector<BoxView> views = ViewsOf(map, object.observations);
  if (object.state != ObjectState::kTentative && config.model != ObjectMethod::kPaper)
    MarkHiddenEdges(map, places, std::span(&id, 1), object.ellipsoid, views);
  return views;
}

bool HasMoved(const Map& map, std::span<const ObjectPlace> places, ObjectId id,
              const ObjectsConfig& config) {
  const Object& object = map.objects.At(id);
  const ViewOverlap overlap = MeasureOverlap(
      object.ellipsoid, VisibleViews(map, places, id, object, config), kMinAcceptIoU);
  return std::abs(overlap.mean_iou - object.mean_iou) > kMovedIoU;
}

void Drop(ObjectId id, const std::string& reason, Map& map) {
  const Object& object = map.objects.At(id);
  Log(LogLevel::kDebug, "{} dropped: {} frame {}", NameForLog(id, object), reason,
      object.last_seen_frame);
  map.objects.Erase(id);
}

void Refit(ObjectId id, std::span<const ObjectPlace> places, const ImageTime& now,
           const ObjectsConfig& config, Map& map) {
  Object object = map.objects.At(id);
  object.was_mapped |= object.state == ObjectState::kMapped;
  ThinObservations(map, object.observations);
  ForgetErasedLandmarks(map, object);
  const bool keep_start =
      object.state == ObjectState::kMapped || object.total_observations % 4 != 0;
  const Ellipsoid* start =
      object.state != ObjectState::kTentative && keep_start ? &object.ellipsoid : nullptr;
  const std::vector<BoxView> views = VisibleViews(map, places, id, object, config);
  const std::optional<ObjectModel> model = FitObjectModel(map, views, start, config);
  if (model) AdoptModel(*model, views, object);
  double surfaces = 0;
  for (const ObjectObservation& o : object.observations) surfaces += o.surface > 0 ? o.weight : 0;
  const ObjectEvidence evidence{
      model.has_value(), object.evidence, model ? model->overlap : ViewOverlap{},
      !object.known_by_landmarks && IsForgotten(UnseenSince(object, now)), surfaces};
  const auto next = NextState(object.state, evidence, config);
  if (!next) return Drop(id, "unseen since", map);
  object.state = model ? *next : ObjectState::kTentative;
  RecognizeByLandmarks(map, config, object);
  const bool is_contradicted = model && IsContradicted(evidence.overlap, config) &&
                               evidence.observations >= config.min_observations;
  map.objects.MutableAt(id) = std::move(object);
  if (is_contradicted && !RefitFromNewer(id, config, map) &&
      evidence.observations >= kNeverConsistent * config.min_observations)
    Drop(id, "its detections agree on no place, the last in", map);
}

void DropUnseen(const ImageTime& now, Map& map) {
  for (const ObjectId id : map.objects.Ids()) {
    const Object& object = map.objects.At(id);
    // An absent object is kept until it is found elsewhere (moved_objects.h).
    const bool is_waiting = IsProvenAbsent(object.absence);
    if (object.state != ObjectState::kMapped && !is_waiting && !object.known_by_landmarks &&
        IsForgotten(UnseenSince(object, now)))
      Drop(id, "unseen since", map);
  }
}

// Those of the objects that `is_concerned` accepts whose ellipsoids no longer fit their boxes as
// before, since their keyframes have moved.
template <typename Predicate>
std::set<ObjectId> MovedObjects(const Map& map, std::span<const ObjectPlace> places,
                                const ObjectsConfig& config, Predicate&& is_concerned) {
  std::set<ObjectId> moved;
  for (const ObjectPlace& place : places)
    if (!place.is_tentative && is_concerned(place) && HasMoved(map, places, place.id, config))
      moved.insert(place.id);
  return moved;
}

// The part of the map where the camera is, which the last local bundle adjustment may have moved.
class Surroundings {
 public:
  Surroundings(const Map& map, std::span<const ObjectSighting> sightings) {
    std::set<KeyframeId> references;
    for (const ObjectSighting& sighting : sightings)
      if (const auto carried = map.ResolveKeyframe(sighting.observation.reference))
        references.insert(carried->by);
    for (const KeyframeId id : references) {
      centers_.push_back(map.keyframes.At(id).cam_from_world.OriginInSource());
      depth_ = std::max(depth_, map.MedianDepth(id));
    }
    keyframes_ = WithNeighbours(map, std::vector(references.begin(), references.end()));
  }
  // The keyframes that the images refer to, and their neighbours.
  std::span<const KeyframeId> Keyframes() const { return keyframes_; }
  // True for every place while the depth of the scene is unknown.
  bool Contain(const ObjectPlace& place) const {
    constexpr double kDepths = 10;  // median depths: beyond, boxes are too small to be detected
    return depth_ == 0 || std::ranges::any_of(centers_, [&](const Eigen::Vector3d& center) {
             return (place.center - center).norm() < kDepths * depth_ + place.radius;
           });
  }

 private:
  std::vector<KeyframeId> keyframes_;
  std::vector<Eigen::Vector3d> centers_;
  double depth_ = 0;  // median
};

// Objects of a loaded map have no time of the present run: they count as seen now.
void BeginTime(const ImageTime& now, const ObjectsConfig& config, Map& map) {
  for (const ObjectId id : map.objects.Ids()) {
    if (map.objects.At(id).last_seen_time) continue;
    Object& object = map.objects.MutableAt(id);
    object.last_seen_time = now.timestamp;
    RecognizeByLandmarks(map, config, object);
  }
}

// Landmarks may be erased while their object is not in view, and then no longer identify it. So the
// waiting objects around the camera are reviewed, also when they are not seen.
void ReviewWaiting(std::span<const ObjectPlace> places, const Surroundings& surroundings,
                   const ObjectsConfig& config, Map& map) {
  for (const ObjectPlace& place : places)
    if (place.is_known_by_landmarks && surroundings.Contain(place) &&
        !IsKnownByLandmarks(map, config, map.objects.At(place.id)))
      map.objects.MutableAt(place.id).known_by_landmarks = false;
}

// An object that the camera looks through counts as absent.
void WeighSightLines(ObjectId id, std::span<const KeyframeId> keyframes, Map& map) {
  const Object* object = map.objects.Find(id);
  if (!object || object->state != ObjectState::kMapped) return;
  const double absence = object->absence + SeenThroughEvidence(map, *object, keyframes);
  if (!IsProvenAbsent(absence)) return;
  Log(LogLevel::kDebug, "the camera looks through the place of " + NameForLog(id, *object));
  map.objects.MutableAt(id).absence = absence;
}

}  // namespace

void UpdateObjects(Map& map, std::span<const ObjectSighting> sightings, const ImageTime& now,
                   const ObjectsConfig& config) {
  UpdateUp(map);
  BeginTime(now, config, map);
  std::set<ObjectId> changed;
  for (const ObjectSighting& sighting : sightings)
    if (const auto id = Receive(sighting, map)) changed.insert(*id);
  const std::vector<ObjectPlace> places = PlacesOf(map.objects);
  const Surroundings surroundings(map, sightings);
  ReviewWaiting(places, surroundings, config, map);
  changed.merge(MovedObjects(
      map, places, config, [&](const ObjectPlace& place) { return surroundings.Contain(place); }));
  for (const ObjectId id : changed) Refit(id, places, now, config, map);
  for (const ObjectPlace& place : places)
    if (surroundings.Contain(place)) WeighSightLines(place.id, surroundings.Keyframes(), map);
  ResolveAbsent(now, config, map);
  MergeDuplicates(map, changed, config);
  DropUnseen(now, map);
}

void ReviewPlaces(const ObjectsConfig& config, Map& map) {
  const std::vector<KeyframeId> keyframes = map.keyframes.Ids();
  for (const ObjectId id : map.objects.Ids()) WeighSightLines(id, keyframes, map);
  ResolveAbsent({}, config, map);
}

void RefitMovedObjects(const ObjectsConfig& config, Map& map) {
  UpdateUp(map);
  const std::vector<ObjectPlace> places = PlacesOf(map.objects);
  const std::set<ObjectId> moved =
      MovedObjects(map, places, config, [](const ObjectPlace&) { return true; });
  const ImageTime no_time_passed;  // no object counts as unseen
  for (const ObjectId id : moved) Refit(id, places, no_time_passed, config, map);
  MergeDuplicates(map, moved, config);
}

}  // namespace oaslam
