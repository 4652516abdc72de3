#include "oaslam/service/served_map.h"

namespace oaslam {
// Counts the large parts; a quarter is added for the small ones.
size_t BytesInMemory(const SavedMap& saved) {
  constexpr size_t kIndexed = 64;  // bytes of a point in an index of places
  size_t bytes = saved.trajectory.capacity() * sizeof(FramePose);
  saved.map.keyframes.ForEach([&](KeyframeId, const Keyframe& k) {
    bytes += sizeof(k) + k.landmarks.size() * sizeof(LandmarkId) +
             k.covisible.size() * sizeof(Covisible) +
             k.features->keypoints.size() * (sizeof(Keypoint) + sizeof(Descriptor)) +
             k.learned_depths.size() * (sizeof(Descriptor) + sizeof(float) + kIndexed);
  });
  saved.map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    bytes += sizeof(landmark) + landmark.observations.size() * sizeof(Observation) + kIndexed;
  });
  saved.map.objects.ForEach([&](ObjectId, const Object& object) {
    bytes += sizeof(object) + object.observations.size() * sizeof(ObjectObservation);
  });
  return bytes + bytes / 4;
}

ServedMap::ServedMap(const MapFile& file, const SlamConfig& config)
    : stored(file.map), localizer(file.path.string(), config), bytes(BytesInMemory(saved())) {}

Map WithEdits(const Map& map, const MapEdits& edits) {
  Map edited = map;  // shares its tables
  for (const auto& [name, entry] : edits.anchors) {
    edited.anchors.erase(name);
    if (entry.anchor) edited.anchors.emplace(name, *entry.anchor);
  }
  return edited;
}

AnchorNews NewsOf(const Map& map, const MapEdits& edits, int64_t since) {
  AnchorNews news;
  news.is_complete = since == 0 || since < edits.map_version;
  for (const auto& [name, entry] : edits.anchors)
    if (!entry.anchor && entry.version > since) news.removed.push_back(name);
  for (const AnchorPose& pose : PosesOf(WithEdits(map, edits))) {
    const auto edit = edits.anchors.find(pose.name);
    const int64_t version = edit == edits.anchors.end() ? 0 : edit->second.version;
    if (news.is_complete || version > since) news.anchors.push_back({pose, version});
  }
  return news;
}

}  // namespace oaslam
