#include "oaslam/objects/object_places.h"

#include <algorithm>

namespace oaslam {

void ObjectPlaces::Update(const Table<ObjectId, Object>& objects) {
  objects.ForEachDifference(known_, [&](ObjectId id, const Object*, const Object* now) {
    const auto at = std::ranges::lower_bound(places_, id, {}, &ObjectPlace::id);
    const bool is_known = at != places_.end() && at->id == id;
    const bool has_place =
        now && (now->state != ObjectState::kTentative || now->known_by_landmarks);
    if (!has_place) {
      if (is_known) places_.erase(at);
      return;
    }
    const ObjectPlace place{id,
                            now->category_id,
                            now->state == ObjectState::kMapped,
                            now->state == ObjectState::kTentative,
                            now->known_by_landmarks,
                            now->ellipsoid.center,
                            now->ellipsoid.half_axes.maxCoeff()};
    if (is_known)
      *at = place;
    else
      places_.insert(at, place);
  });
  known_ = objects;
}

}  // namespace oaslam
