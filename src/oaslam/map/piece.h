#pragma once

#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// A map that could not be joined with the others so far, in a frame and a unit of its own, and the
// poses of the frames that made it. No two pieces of a run share an id.
struct Piece {
  Map map;
  std::vector<FramePose> trajectory;  // ascending by frame
};

// Adds the poses of a piece to those of another that it was joined with, `scale` times as large.
// Where both have a frame the own pose stays, but for one by objects where the other is by points.
void AdoptPoses(const std::vector<FramePose>& other, double scale, std::vector<FramePose>& own);

// A keyframe as the frame that it was, with the boxes that objects of the map keep of it.
Frame FrameOf(const Map& map, KeyframeId id);

}  // namespace oaslam
