#pragma once

#include <map>
#include <optional>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"

namespace oaslam {

// A mapped object with what proposals need of it.
struct ObjectPlaceInTime {
  ObjectId id;
  int category_id = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // world
  double radius = 0;                                 // largest half axis
  KeyframeId newest;                                 // the last that its observations refer to
};

// A part of the map that seems to contain the objects around a keyframe a second time.
struct LoopProposal {
  Similarity old_from_current;
  std::vector<ObjectId> old_objects;  // those of the old part that have a copy, ascending
};

// Finds where drift has mapped objects twice. Keeps the places of the mapped objects.
class LoopProposals {
 public:
  // Compares the objects seen lately (the constellation) with those that have not been seen for
  // `min_apart` keyframes. One similarity must move at least four objects, and half of the
  // constellation or more, to places where objects of the same classes and sizes are. It may turn
  // and scale no more than drift does; where the map knows its vertical, it turns about that only.
  // Returns the similarity that most objects support, if there is one. The caller must verify it,
  // since the same furniture may stand in two rooms.
  std::optional<LoopProposal> Find(const Map& map, KeyframeId current, uint32_t min_apart);

 private:
  void Update(const Map& map);

  Table<ObjectId, Object> known_;                 // as of the last call
  std::map<ObjectId, ObjectPlaceInTime> places_;  // of `known_`
};

// Drift turns and scales a map by no more than this.
bool IsTurnAndScaleOfDrift(const Similarity& correction);

}  // namespace oaslam
