#pragma once

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/mapping/loop_closing.h"

namespace oaslam {

// The evidence of the objects around both ends for a loop, and against it.
struct LoopObjects {
  int agreeing = 0;       // objects that the images of the other end show where the loop moves them
  int contradicting = 0;  // objects that these images should show there, and do not
};

// Moves the mapped objects around each end by the loop's similarity, and looks for a detection of
// their class there, mapped or not, in the images around the other end. An object contradicts only
// if several images should show it large, well inside, and not behind boxes or landmarks. Objects
// that were seen from both ends do not count. Boxes of movable classes are not in the map, so that
// a person hides nothing here. An image without any box of an object counts neither way.
LoopObjects CompareObjects(const Map& map, const LoopClosure& loop);

// Whether the objects refute the loop: several contradict, and more than twice as many as agree.
// Corridors, windows and posters often have the same points, but other objects around them.
bool AreObjectsAgainst(const LoopObjects& objects);

}  // namespace oaslam
