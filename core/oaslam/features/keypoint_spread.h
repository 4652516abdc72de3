#pragma once

#include <vector>

#include "oaslam/features/orb_kernels.h"
#include "oaslam/types.h"

namespace oaslam {

// Selects about `count` corners, evenly spread over `area` (pixels) and strongest in their
// neighbourhood: cells of a quadtree are split until there are `count` of them, and of each cell
// the corner with the highest score is kept.
std::vector<Corner> SpreadKeypoints(const std::vector<Corner>& corners, const Box& area, int count);

}  // namespace oaslam
