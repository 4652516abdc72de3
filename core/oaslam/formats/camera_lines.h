#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "oaslam/camera.h"

namespace oaslam {

// Calibrations that are lines of numbers: COLMAP's cameras.txt ("ID MODEL WIDTH HEIGHT PARAMS");
// one line "fx fy cx cy [k1 k2 p1 p2 [k3 ...]]" (DPVO, DROID-SLAM); a matrix of 3 or 4 rows
// (ScanNet, Stray Scanner). Nothing where the text is no such file. Throws InputError.
std::optional<Camera> ReadCameraLines(const std::string& text, const std::string& path,
                                      const cv::Size& image_size);

}  // namespace oaslam
