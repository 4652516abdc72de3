#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

std::vector<uint8_t> EncodeJpeg(const cv::Mat& picture, int quality);

// Cuts out a box of the ideal image with a margin around it, at most `max_side` pixels large; empty
// where nothing is left.
cv::Mat CutOut(const cv::Mat& picture, double scale, const Box& box, int max_side);

}  // namespace oaslam
