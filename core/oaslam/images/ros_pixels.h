#pragma once

#include <opencv2/core.hpp>

#include "oaslam/recordings/ros_messages.h"

namespace oaslam {

// The pixels of images of ROS, 8-bit, grey or BGR. These throw InputError for an encoding that is
// not read, and for rows that are longer than what is there.

// `bits`: how many of the 16 of a mono16 image are used.
cv::Mat PixelsOf(const RosImage& image, bool color, int bits);
// Empty where the content is neither a JPEG nor a PNG, or is damaged.
cv::Mat PixelsOf(const RosCompressedImage& image, bool color);

// The values of an image in its own type: mono16, and depths in 16UC1 and 32FC1.
cv::Mat ValuesOf(const RosImage& image);

}  // namespace oaslam
