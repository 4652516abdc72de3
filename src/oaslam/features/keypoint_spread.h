#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace oaslam {

// Chooses about `count` of the corners, evenly spread over `area` and strongest in their place: a quadtree whose cells are
// split until there are `count` of them; of each cell the corner with the largest response stays.
std::vector<cv::KeyPoint> SpreadKeypoints(const std::vector<cv::KeyPoint>& corners, const cv::Rect2f& area, int count);

}  // namespace oaslam
