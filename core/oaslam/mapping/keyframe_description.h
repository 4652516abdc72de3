#pragma once

#include "oaslam/map/map.h"

namespace oaslam {

// Gives the points of a keyframe learned descriptors by its image, which it needs no more. Does
// nothing, and returns false, where it has none.
bool DescribeKeyframe(KeyframeId id, Map& map);

// The same of all keyframes; takes some 20 ms for each that still has its image.
void DescribeKeyframes(Map& map);

}  // namespace oaslam
