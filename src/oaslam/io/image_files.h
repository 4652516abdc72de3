#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace oaslam {

// 8-bit, grey or BGR; empty where the file is missing or no image. The orientation in its metadata is not applied,
// since a calibration is of the stored pixels.
cv::Mat ReadImage(const std::string& path, bool color);

// An image in colour, where it is grey and a file may show it so; else as it is.
cv::Mat InColor(const cv::Mat& image, const std::string& path);

bool HasImageExtension(const std::string& path);

// "2.png" before "10.png": runs of digits compare as numbers.
bool NaturalLess(const std::string& a, const std::string& b);

// The images of a folder, in natural order. Throws InputError when it cannot be read.
std::vector<std::string> ImageNames(const std::string& folder);

}  // namespace oaslam
