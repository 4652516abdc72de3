#pragma once

#include <span>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The map as if each image had been taken at one instant, that of its middle row, which is what its
// time stamp and its pose stand for: the rows are read out from top to bottom within `readout_s`
// (below 0: from bottom to top) while the camera moves. Key points are moved to where they would
// have been, by the motion of `trajectory` around the keyframe and the depth of their landmarks,
// and a global bundle adjustment follows, in a few rounds, as the one gives the other. A keyframe
// without a pose shortly before or after it stays as it is.
Map WithoutReadout(const Map& map, std::span<const FramePose> trajectory, double readout_s,
                   const BundleConfig& config, int min_shared_landmarks);

}  // namespace oaslam
