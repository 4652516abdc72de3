#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/image_source.h"

namespace oaslam {

// Whether these bytes begin a HEIF file: HEIC and AVIF photos.
bool IsHeif(const std::vector<char>& bytes);

// Its main image, 8-bit, grey or BGR; empty where the file is damaged. Orientation::kUpright
// applies the transformations that the file itself states. Throws InputError that names the path,
// where this system has no decoder.
cv::Mat DecodeHeif(const std::vector<char>& bytes, bool color, Orientation orientation,
                   const std::string& path);

// The EXIF block of its main image, as in a JPEG file ("Exif\0\0" first); empty where it has none.
std::vector<unsigned char> ExifOfHeif(const std::vector<char>& bytes);

}  // namespace oaslam
