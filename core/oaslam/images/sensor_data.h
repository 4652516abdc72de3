#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace oaslam {

// Raw sensor data, with one colour in each pixel (a Bayer mosaic), must be demosaiced before they
// are an image. The functions below recognise raw data.

// By the extension of a camera maker's file, such as .dng.
bool HasRawExtension(const std::string& path);
// By the tags of a TIFF or DNG file.
bool IsRawTiff(const std::vector<char>& bytes);
// By the name of an encoding of ROS in the name of a file or of its folder, such as bayer_rggb8.
bool IsNamedBayer(const std::string& path);
// By the pixels of an image of one channel: those of the same colour, two pixels apart, are more
// alike than neighbours.
bool IsBayerMosaic(const cv::Mat& grey);

// The message that refuses such a file.
std::string RefusalOfSensorData(const std::string& path);

}  // namespace oaslam
