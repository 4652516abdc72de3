#pragma once

#include <opencv2/core.hpp>

namespace oaslam {

// Whether an image, 8-bit grey or BGR, is an equirectangular panorama of 360 by 180 degrees: twice
// as wide as high, its left edge continues its right edge, and its first or last row shows one
// direction only.
bool IsPanorama(const cv::Mat& image);

}  // namespace oaslam
