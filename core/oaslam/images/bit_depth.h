#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace oaslam {

// An image file with its own number of bits and channels; empty where OpenCV cannot read it.
cv::Mat ReadUnchanged(const std::string& path);

// How many of the 16 bits of an image are used, 8 to 16: cameras write 10 to 14 bits of data
// into 16.
int UsedBits(const cv::Mat& image);

// Converts an image of 16 bits a pixel, of which the lowest `bits` are used, to 8 bits; larger
// values become white.
cv::Mat InEightBits(const cv::Mat& image, int bits);

// Looks at a few image files of a recording before they are read: returns how many of their 16 bits
// are used, one number for all images (16 for images of 8 bits), and logs it unless `quiet`.
// Returns 16 where fewer than `least` are used, since the images may only be dark. Throws
// InputError where the first image is raw sensor data.
int LookAtImages(const std::string& source, const std::vector<std::string>& paths, bool quiet,
                 int least = 8);

}  // namespace oaslam
