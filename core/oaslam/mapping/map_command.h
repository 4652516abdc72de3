#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/object_edit.h"
#include "oaslam/objects/association.h"

namespace oaslam {

struct InitialPoint {
  int first_keypoint = 0, second_keypoint = 0;
  // In the first camera's frame, for a baseline of 1 (InitialMap::is_measured: in the unit of the
  // map).
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

// A new map from two frames.
struct InitialMap {
  Frame first, second;
  KeyframeId first_id, second_id;
  Rigid3 second_from_first;  // |translation| = 1, unless depths were measured
  std::vector<InitialPoint> points;
  Rigid3 second_from_world;
  Rigid3 motion;  // second from first by the odometry, in the unit of the map
  // The points are by the depths of a depth camera, and they and second_from_first are in the unit
  // of the map: there need be no parallax.
  bool is_measured = false;
};

// How often a landmark was expected in a frame since the last keyframe, and how often it was found.
struct LandmarkUse {
  LandmarkId landmark;
  int visible = 0, found = 0;
};

struct KeyframeInsertion {
  KeyframeId id;
  TrackedFrame frame;
  // Motions to this keyframe and to earlier ones, by the odometry's present estimates.
  std::vector<std::pair<KeyframeId, KeyframeMotion>> motions{};
  int loops_closed = 0;  // Map::loops_closed of the map in whose unit the motions are
  // If it is valid: the last keyframe with a right motion. The odometry has corrected the motions
  // of the keyframes after that.
  KeyframeId right_until{};
};

// A submap to be joined with the mapper's map (JoinSubmap).
struct JoiningMap {
  std::shared_ptr<const Map> map;
  Similarity world_from_map;
};

// Waits for the background bundle adjustment and applies it, so that nothing moves the map later.
// In live mode the mapper does not wait for the bundle adjustment: it applies the result with a
// later keyframe, and the map does not move before then.
struct AdoptAdjustment {};

// The caller must scale the tracker, too.
struct MetricScale {
  double metres_per_unit = 1;
  std::optional<UnitEvidence> by_objects{};
};

// Replaces all anchors.
using NewAnchors = std::map<std::string, Anchor>;

// A user's change to an object, which was tried on the same map before.
struct ObjectChange {
  ObjectId object;
  ObjectEdit edit;
};

using MapEdit =
    std::variant<std::monostate, InitialMap, KeyframeInsertion, JoiningMap, AdoptAdjustment,
                 MetricScale, ClassRelations, NewAnchors, ObjectChange>;

// A change of the map, and what was seen since the previous command.
struct MapCommand {
  int frame_index = 0;
  MapEdit edit{};
  std::vector<LandmarkUse> uses{};
  std::vector<ObjectSighting> sightings{};  // in order of frames
  bool is_urgent = false;                   // every later snapshot contains it
};

}  // namespace oaslam
