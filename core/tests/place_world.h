#pragma once

#include "oaslam/matching/place_index.h"
#include "synthetic_world.h"

namespace oaslam::synthetic {

constexpr WorldOptions kPlaceWorld{.points = 1500, .cameras = 8, .seed = 1};

// A world, its map, and an index of its places.
struct PlaceWorld {
  World world = MakeWorld(kPlaceWorld);
  MappedWorld mapped = MakeMap(world, {.position_noise = 0.005});
  PlaceIndex index{mapped.map};
};

// The same with learned descriptors, and chance as ORB's.
struct DescribedWorld : PlaceWorld {
  Rng rng{9};

  // `all_landmarks`: else every second point is known to its keyframes alone, by its depth there.
  explicit DescribedWorld(bool all_landmarks) {
    for (const KeyframeId id : mapped.map.keyframes.Ids()) {
      Keyframe& keyframe = mapped.map.keyframes.MutableAt(id);
      keyframe.features = KnownByLearned(*keyframe.features, rng);
      for (const LandmarkId l : keyframe.landmarks)
        keyframe.learned_depths.push_back(
            l.IsValid() ? static_cast<float>(
                              (keyframe.cam_from_world * mapped.map.landmarks.At(l).position).z())
                        : 0);
    }
    const std::vector<LandmarkId> ids = mapped.map.landmarks.Ids();
    for (size_t i = 0; i < ids.size() && !all_landmarks; i += 2) mapped.map.EraseLandmark(ids[i]);
    index = PlaceIndex(mapped.map);
  }
};

}  // namespace oaslam::synthetic
