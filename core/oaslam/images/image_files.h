#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/image_source.h"

namespace oaslam {

// 8-bit, grey or BGR; empty where the file is missing or no image. Calibrations and boxes usually
// refer to the stored pixels. `bits`: how many bits a 16-bit image uses (LookAtImages); 0: the
// function determines it from this image alone. Throws InputError for the data of a sensor, and for
// a file that this system has no decoder for.
cv::Mat ReadImage(const std::string& path, bool color,
                  Orientation orientation = Orientation::kStored, int bits = 16);

// All bytes of a file; none where it cannot be read, or is a folder.
std::vector<char> BytesOf(const std::string& path);

// The image in colour, if it is grey and the file from which it was read, in this orientation,
// contains colours; else the image itself.
cv::Mat InColor(const cv::Mat& image, const std::string& path, Orientation orientation);

// The image turned clockwise by so many quarters, 0 to 3; itself for 0.
cv::Mat Turned(const cv::Mat& image, int quarters);

bool HasImageExtension(const std::string& path);

// Whether the operating system made the file of this name beside the images: macOS's metadata of
// another file (._NAME), .DS_Store, Thumbs.db and the like, hidden files, thumbnails.
bool IsHelperFile(const std::string& name);

// Images a second where nothing tells their times; that of most cameras.
inline constexpr double kDefaultFps = 30;

// "2.png" before "10.png": runs of digits compare as numbers.
bool NaturalLess(const std::string& a, const std::string& b);

// The first, by path, of the folders with images that are at most two levels below this one; empty
// where there is none.
std::string FolderOfImagesBelow(const std::string& folder);

// The images of a folder, in natural order. Helper files and files that are no images, whatever
// their names, are not among them; damaged and empty ones are. Throws InputError when it cannot be
// read.
std::vector<std::string> ImageNames(const std::string& folder);

}  // namespace oaslam
