#include "oaslam/objects/object_mapper.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "oaslam/objects/life_cycle.h"
#include "oaslam/objects/object_merging.h"
#include "oaslam/objects/object_model.h"
#include "oaslam/objects/occlusion.h"
#include "oaslam/objects/upright.h"

namespace oaslam {
namespace {

constexpr double kMovedIoU = 0.02;  // a change of the overlap without new observations: its keyframes have moved

// The running ratio of detections to views, without a counter of views: these are total_observations / rate.
void CountView(bool detected, Object& object) {
  const double hits = std::max(object.total_observations, 1), views = hits / object.detection_rate;
  object.detection_rate = std::clamp((hits + detected) / (views + 1), 0.02, 1.0);
}

// The object of a sighting that is to be updated; nothing if it was dropped meanwhile.
std::optional<ObjectId> Receive(const ObjectSighting& sighting, Map& map) {
  if (sighting.is_new && !map.objects.Contains(sighting.object) && !map.merged_objects.Contains(sighting.object)) {
    Object object;
    object.category_id = sighting.category_id;
    map.objects.Insert(sighting.object, std::move(object));
  }
  const std::optional<ObjectId> id = map.ResolveObject(sighting.object);
  if (!id) return std::nullopt;
  Object& object = map.objects.MutableAt(*id);
  if (object.state == ObjectState::kMapped) CountView(sighting.detected, object);
  if (!sighting.detected) return std::nullopt;
  auto& observations = object.observations;
  const auto place =
      std::ranges::upper_bound(observations, sighting.observation.frame_index, {}, &ObjectObservation::frame_index);
  observations.insert(place, sighting.observation);
  ++object.total_observations;
  object.last_seen_frame = std::max(object.last_seen_frame, sighting.observation.frame_index);
  AddVotes(sighting.landmarks, std::vector<uint16_t>(sighting.landmarks.size(), 1), object);
  return id;
}

void ForgetErasedLandmarks(const Map& map, Object& object) {
  size_t kept = 0;
  for (size_t i = 0; i < object.landmarks.size(); ++i) {
    if (!map.landmarks.Contains(object.landmarks[i])) continue;
    object.landmarks[kept] = object.landmarks[i];
    object.landmark_votes[kept++] = object.landmark_votes[i];
  }
  object.landmarks.resize(kept);
  object.landmark_votes.resize(kept);
}

// The paper's model takes all boxes for whole.
std::vector<BoxView> VisibleViews(const Map& map, ObjectId id, const Object& object, const ObjectsConfig& config) {
  std::vector<BoxView> views = ViewsOf(map, object.observations);
  if (object.state != ObjectState::kTentative && config.model != "paper") MarkHiddenEdges(map, std::span(&id, 1), object.ellipsoid, views);
  return views;
}

bool HasMoved(const Map& map, ObjectId id, const Object& object, const ObjectsConfig& config) {
  if (object.state == ObjectState::kTentative) return false;
  const ViewOverlap overlap = MeasureOverlap(object.ellipsoid, VisibleViews(map, id, object, config), config.min_accept_iou);
  return std::abs(overlap.mean_iou - object.mean_iou) > kMovedIoU;
}

void Refit(ObjectId id, int current_frame, const ObjectsConfig& config, Map& map) {
  Object object = map.objects.At(id);
  ThinObservations(map, object.observations);
  ForgetErasedLandmarks(map, object);
  const bool keep_start = object.state == ObjectState::kMapped || object.total_observations % 4 != 0;
  const Ellipsoid* start = object.state != ObjectState::kTentative && keep_start ? &object.ellipsoid : nullptr;
  const std::vector<BoxView> views = VisibleViews(map, id, object, config);
  const std::optional<ObjectModel> model = FitObjectModel(map, views, start, config);
  if (model) AdoptModel(*model, views, object);
  const ObjectEvidence evidence{model.has_value(), object.total_observations, model ? model->overlap.accept_share : 0,
                                std::max(current_frame - object.last_seen_frame, 0)};
  if (const auto next = NextState(object.state, evidence, config)) {
    object.state = model ? *next : ObjectState::kTentative;
    map.objects.MutableAt(id) = std::move(object);
  } else {
    map.objects.Erase(id);
  }
}

void DropUnseen(int current_frame, const ObjectsConfig& config, Map& map) {
  for (const ObjectId id : map.objects.Ids()) {
    const Object& object = map.objects.At(id);
    if (object.state != ObjectState::kMapped && current_frame - object.last_seen_frame > config.drop_after)
      map.objects.Erase(id);
  }
}

}  // namespace

void UpdateObjects(Map& map, std::span<const ObjectSighting> sightings, int current_frame,
                   const ObjectsConfig& config) {
  if (const auto up = EstimateUp(map)) map.up = up;
  std::set<ObjectId> changed;
  for (const ObjectSighting& sighting : sightings)
    if (const auto id = Receive(sighting, map)) changed.insert(*id);
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (!changed.contains(id) && HasMoved(map, id, object, config)) changed.insert(id);
  });
  for (const ObjectId id : changed) Refit(id, current_frame, config, map);
  MergeDuplicates(map, changed, config);
  DropUnseen(current_frame, config, map);
}

}  // namespace oaslam
