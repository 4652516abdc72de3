#include "oaslam/objects/object_places.h"

#include <algorithm>

namespace oaslam {

namespace {

bool HasPlace(const Object& object) {
  return object.state != ObjectState::kTentative || object.known_by_landmarks;
}

ObjectPlace PlaceOf(ObjectId id, const Object& object) {
  return {id,
          object.state == ObjectState::kMapped,
          object.state == ObjectState::kTentative,
          object.known_by_landmarks,
          object.ellipsoid.center,
          object.ellipsoid.half_axes.maxCoeff()};
}

}  // namespace

std::vector<ObjectPlace> PlacesOf(const Table<ObjectId, Object>& objects) {
  std::vector<ObjectPlace> places;
  objects.ForEach([&](ObjectId id, const Object& object) {
    if (HasPlace(object)) places.push_back(PlaceOf(id, object));
  });
  return places;
}

void ObjectPlaces::Update(const Table<ObjectId, Object>& objects) {
  objects.ForEachDifference(known_, [&](ObjectId id, const Object*, const Object* now) {
    const auto at = std::ranges::lower_bound(places_, id, {}, &ObjectPlace::id);
    const bool is_known = at != places_.end() && at->id == id;
    const bool has_place = now && HasPlace(*now);
    if (!has_place) {
      if (is_known) places_.erase(at);
      return;
    }
    const ObjectPlace place = PlaceOf(id, *now);
    if (is_known)
      *at = place;
    else
      places_.insert(at, place);
  });
  known_ = objects;
}

}  // namespace oaslam
