#pragma once

#include <map>
#include <memory>

#include "oaslam/map/later_poses.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The map without a loop that proved wrong.
struct UndoneLoop {
  Map map;
  LaterPoses later;  // how poses relative to keyframes change
  // Landmarks of the bent map that the loop had merged, to those that the camera sees.
  std::map<LandmarkId, LandmarkId> landmarks;
};

// Undoes Map::refuted_loop: returns the map as it was before that loop was closed, with what was
// mapped since. Later keyframes follow from the one that closed the loop, as the camera went: each
// keeps its pose relative to the one before it, at the scale of before, and is refined by the
// landmarks that it sees. A landmark that the loop had merged of two is two again, and later
// observations go to the one that the camera saw last; objects likewise, by the boxes that they
// explain. The loop is among Map::undone_loops then. A global bundle adjustment should follow.
UndoneLoop UndoLoop(std::shared_ptr<const Map> bent, int min_shared_landmarks);

}  // namespace oaslam
