#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// The ellipse with the area moments of a segmentation mask, [cx, cy, width, height, theta] in
// network pixels, in the coordinates of boxes (the first pixel covers [0, 1]); width along theta,
// which is in (-pi/2, pi/2]. The mask is where the sum of prototypes (float, [1, M, rows, columns],
// covering the network's input), weighted by the M coefficients, is above 0 (its sigmoid above one
// half), inside the box. Returns nothing for fewer than ten cells, which have no reliable shape.
std::optional<std::array<double, 5>> EllipseFromMask(const cv::Mat& prototypes,
                                                     const std::vector<float>& coefficients,
                                                     const Box& box, const cv::Size& network_size);

}  // namespace oaslam
