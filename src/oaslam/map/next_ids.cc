#include "oaslam/map/next_ids.h"

#include <algorithm>

namespace oaslam {

NextIds NextIdsOf(const Map& map) {
  NextIds ids{0, map.next_landmark, 0};
  const auto pass = [](uint32_t& next, auto id) { next = std::max(next, id.value + 1); };
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe&) { pass(ids.keyframe, id); });
  map.retired.ForEach([&](KeyframeId id, const RetiredKeyframe&) { pass(ids.keyframe, id); });
  map.landmarks.ForEach([&](LandmarkId id, const Landmark&) { pass(ids.landmark, id); });
  map.objects.ForEach([&](ObjectId id, const Object&) { pass(ids.object, id); });
  map.merged_objects.ForEach([&](ObjectId id, const ObjectId&) { pass(ids.object, id); });
  return ids;
}

NextIds Behind(const NextIds& a, const NextIds& b) {
  return {std::max(a.keyframe, b.keyframe), std::max(a.landmark, b.landmark),
          std::max(a.object, b.object)};
}

}  // namespace oaslam
