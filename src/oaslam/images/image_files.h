#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace oaslam {

enum class Orientation {
  kStored,   // the pixels as they are in the file
  kUpright,  // turned (and mirrored) as its EXIF orientation says, where it has one OpenCV knows
};

// 8-bit, grey or BGR; empty where the file is missing or no image. A calibration and boxes are
// mostly of the stored pixels.
cv::Mat ReadImage(const std::string& path, bool color,
                  Orientation orientation = Orientation::kStored);

// An image in colour, where it is grey and the file that it was read from, in this orientation, may
// show it; else as it is.
cv::Mat InColor(const cv::Mat& image, const std::string& path, Orientation orientation);

bool HasImageExtension(const std::string& path);

// "2.png" before "10.png": runs of digits compare as numbers.
bool NaturalLess(const std::string& a, const std::string& b);

// The images of a folder, in natural order. Throws InputError when it cannot be read.
std::vector<std::string> ImageNames(const std::string& folder);

}  // namespace oaslam
