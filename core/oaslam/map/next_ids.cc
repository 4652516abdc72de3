#include "oaslam/map/next_ids.h"

#include <algorithm>

namespace oaslam {

uint32_t NextObjectOf(const Map& map) {
  uint32_t next = 0;
  const auto pass = [&](ObjectId id) { next = std::max(next, id.value + 1); };
  map.objects.ForEach([&](ObjectId id, const Object&) { pass(id); });
  map.merged_objects.ForEach([&](ObjectId id, const ObjectId&) { pass(id); });
  return next;
}

NextIds NextIdsOf(const Map& map) {
  NextIds ids{0, map.next_landmark, NextObjectOf(map)};
  const auto pass = [&](KeyframeId id) { ids.keyframe = std::max(ids.keyframe, id.value + 1); };
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe&) { pass(id); });
  map.retired.ForEach([&](KeyframeId id, const RetiredKeyframe&) { pass(id); });
  return ids;
}

NextIds Behind(const NextIds& a, const NextIds& b) {
  return {std::max(a.keyframe, b.keyframe), std::max(a.landmark, b.landmark),
          std::max(a.object, b.object)};
}

}  // namespace oaslam
