#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "oaslam/camera.h"

namespace oaslam {

// The camera of a calibration file as it stands there; width and height 0 where the file has none.
// `image_size` picks among several cameras of a cameras.txt.
Camera ReadCameraFile(const std::string& path, const cv::Size& image_size);

}  // namespace oaslam
