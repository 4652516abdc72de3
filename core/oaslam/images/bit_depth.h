#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace oaslam {

// How many of the 16 bits of an image are used, 8 to 16: cameras write 10 to 14 bits of data
// into 16.
int UsedBits(const cv::Mat& image);

// An image of 16 bits in 8, of which `bits` are used; brighter pixels are white.
cv::Mat InEightBits(const cv::Mat& image, int bits);

// Looks at a few image files of a recording before they are read: returns how many of 16 bits they
// use (16 where they have 8), the same for all images, and says so, unless `quiet`. Fewer than
// `least` may be darkness: 16 then. Throws InputError where the first is the data of a sensor.
int LookAtImages(const std::string& source, const std::vector<std::string>& paths, bool quiet,
                 int least = 8);

}  // namespace oaslam
