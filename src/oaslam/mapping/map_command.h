#pragma once

#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/command.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/association.h"

namespace oaslam {

// A submap to be joined with the mapper's map (JoinSubmap).
struct JoiningMap {
  std::shared_ptr<const Map> map;
  Similarity world_from_map;
};

// Waits for the background bundle adjustment and applies it, so that nothing moves the map later.
// Live mode does not wait; the map does not move until its next keyframe.
struct AdoptAdjustment {};

// The caller must scale the tracker, too.
struct MetricScale {
  double metres_per_unit = 1;
};

// Replaces all anchors.
using NewAnchors = std::map<std::string, Anchor>;

using MapEdit = std::variant<std::monostate, InitialMap, KeyframeInsertion, JoiningMap,
                             AdoptAdjustment, MetricScale, ClassRelations, NewAnchors>;

// A change of the map, and what was seen since the previous command.
struct MapCommand {
  int frame_index = 0;
  MapEdit edit{};
  std::vector<LandmarkUse> uses{};
  std::vector<ObjectSighting> sightings{};  // in order of frames
  bool is_urgent = false;                   // every later snapshot contains it
};

}  // namespace oaslam
