#pragma once

#include <optional>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"

namespace oaslam {

// A mapped object, as loops are proposed by it.
struct ObjectPlaceInTime {
  ObjectId id;
  int category_id = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // world
  double radius = 0;                                 // largest half axis
  KeyframeId newest;                                 // the last that its observations refer to
};

// A part of the map that seems to hold the things about a keyframe a second time.
struct LoopProposal {
  Similarity old_from_current;
  std::vector<ObjectId> old_objects;  // those of the old part that have a copy, ascending
};

// Finds where drift has mapped things twice. Keeps the places of the mapped objects.
class LoopProposals {
 public:
  // Looks for the constellation of the things seen lately among those that have not been seen for
  // `min_apart` keyframes: at least four of the same classes and sizes, half of the constellation
  // or more, must be in the places where one similarity takes them. It may turn and scale no more
  // than drift does, and where the map knows its vertical it turns about that only. Proposes the
  // similarity that most things support, if there is one; whether it is right is for others to
  // verify, since one set of furniture may stand in two rooms.
  std::optional<LoopProposal> Find(const Map& map, KeyframeId current, uint32_t min_apart);

 private:
  void Update(const Map& map);

  Table<ObjectId, Object> known_;          // as of the last call
  std::vector<ObjectPlaceInTime> places_;  // of `known_`, ascending by id
};

// Drift turns and scales a map by no more than this.
bool IsTurnAndScaleOfDrift(const Similarity& correction);

}  // namespace oaslam
