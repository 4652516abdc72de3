#pragma once

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/mapping/loop_closing.h"

namespace oaslam {

// What the objects about both ends of a loop say of it.
struct LoopObjects {
  int agreeing = 0;       // objects that the images of the other end show where the loop takes them
  int contradicting = 0;  // objects that they would show there, and do not
};

// Looks for the mapped objects about each end of the loop in the images about the other end, where
// the loop's similarity takes them: for a detection of their class, mapped or not. An object
// contradicts only if several images would show it large, well inside, and not behind boxes or
// landmarks. Objects that were seen from both ends, or whose classes move, say nothing.
LoopObjects CompareObjects(const Map& map, const LoopClosure& loop);

// Whether the objects refute the loop: several contradict, and more than twice as many as agree.
// Corridors, windows and posters look alike by their points; what stands about them does not.
bool AreObjectsAgainst(const LoopObjects& objects);

}  // namespace oaslam
