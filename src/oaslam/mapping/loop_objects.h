#pragma once

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/mapping/loop_closing.h"

namespace oaslam {

// What the objects about both ends of a loop say of it.
struct LoopObjects {
  int agreeing = 0;       // objects of the one part that the loop brings to one of their class
  int contradicting = 0;  // objects where the other part shows, in full view, none of their class
};

// Compares the mapped objects that the keyframes about the current end saw with those about the old
// end, where the loop's similarity would take them. An object contradicts only if several keyframes
// of the other end would have shown it well inside the image and not behind others. Objects that
// were seen from both ends, or whose classes move, say nothing.
LoopObjects CompareObjects(const Map& map, const LoopClosure& loop);

// Whether the objects refute the loop: several contradict, and more than agree. Corridors, windows
// and posters look alike by their points; what stands about them does not.
bool AreObjectsAgainst(const LoopObjects& objects);

}  // namespace oaslam
