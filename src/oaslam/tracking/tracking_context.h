#pragma once

#include "oaslam/map/next_ids.h"
#include "oaslam/types.h"

namespace oaslam {

// What a tracker may do with its map.
enum class MapUse {
  kExtend,  // keyframes and objects are added
  // Another submap grows, which may be joined with this one: no keyframes are added, and images in
  // which the camera was lost get no pose by its motion.
  kHold,
  kRead,  // localization alone: nothing is added
};

// What the owner of a tracker decides for an image.
struct TrackingContext {
  MapUse use = MapUse::kExtend;
  RelocalizationMode search = RelocalizationMode::kPointsAndObjects;
  // Gives the ids of new keyframes and objects, which no two submaps of a run share.
  NextIds* ids = nullptr;

  bool IsMapping() const { return use != MapUse::kRead; }
};

}  // namespace oaslam
