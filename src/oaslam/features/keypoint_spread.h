#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

#include "oaslam/features/orb_kernels.h"

namespace oaslam {

// Selects about `count` corners, evenly spread over `area` and strongest in their neighbourhood:
// cells of a quadtree are split until there are `count` of them, and of each cell the corner with
// the highest score is kept.
std::vector<Corner> SpreadKeypoints(const std::vector<Corner>& corners, const cv::Rect2f& area,
                                    int count);

}  // namespace oaslam
