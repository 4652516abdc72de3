#pragma once

#include "oaslam/map/map.h"

namespace oaslam {

// Computes learned descriptors for points of a keyframe from its image, and releases the image.
// Does nothing, and returns false, where the keyframe has no image.
bool DescribeKeyframe(KeyframeId id, Map& map);

// Describes all keyframes; takes some 20 ms for each that still has its image.
void DescribeKeyframes(Map& map);

}  // namespace oaslam
