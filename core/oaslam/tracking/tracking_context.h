#pragma once

#include <cstdint>

#include "oaslam/types.h"

namespace oaslam {

// What a tracker may do with its map.
enum class MapUse {
  kExtend,  // keyframes and objects are added
  // Another submap grows, which may be joined with this one: the camera is followed, but no
  // keyframe is added, and the images in which it was lost are not placed afterwards.
  kHold,
  kRead,  // localization alone: nothing is added
};

// What the owner of a tracker decides for an image.
struct TrackingContext {
  MapUse use = MapUse::kExtend;
  RelocalizationMode search = RelocalizationMode::kPointsAndObjects;
  // The ids of the next new keyframe of the submap, and of the next new object of the run: two
  // submaps that are tracked side by side share neither.
  uint32_t* next_keyframe = nullptr;
  uint32_t* next_object = nullptr;

  bool IsMapping() const { return use != MapUse::kRead; }
};

}  // namespace oaslam
