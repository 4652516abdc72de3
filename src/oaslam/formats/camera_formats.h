#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "oaslam/camera.h"

namespace oaslam {

// Reads the camera of a calibration file unchecked; width and height are 0 where the file has none.
// `image_size` selects among several cameras of a cameras.txt.
Camera ReadCameraFile(const std::string& path, const cv::Size& image_size);

}  // namespace oaslam
