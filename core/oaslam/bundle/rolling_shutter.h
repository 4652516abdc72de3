#pragma once

#include <span>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Corrects a map for a rolling shutter, which reads out the rows of an image from top to bottom
// within `readout_s` (below 0: from bottom to top) while the camera moves: the result is as if each
// image had been taken at the time of its middle row, to which its time stamp and pose refer. Key
// points are moved by the motion of `trajectory` near the keyframe and the depth of their
// landmarks, and a global bundle adjustment follows; both steps are repeated a few times, since
// each depends on the result of the other. A keyframe without another pose shortly before or after
// it is not changed.
Map WithoutReadout(const Map& map, std::span<const FramePose> trajectory, double readout_s,
                   const BundleConfig& config);

}  // namespace oaslam
