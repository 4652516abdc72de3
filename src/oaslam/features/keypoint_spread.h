#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

#include "oaslam/features/orb_kernels.h"

namespace oaslam {

// Chooses about `count` of the corners, evenly spread over `area` and strongest in their place: a
// quadtree whose cells are split until there are `count` of them; of each cell the corner with the
// highest score stays.
std::vector<Corner> SpreadKeypoints(const std::vector<Corner>& corners, const cv::Rect2f& area,
                                    int count);

}  // namespace oaslam
