#pragma once

#include <memory>
#include <string>
#include <vector>

#include "oaslam/image_source.h"

namespace oaslam {

// The images of a topic in a recording of ROS, with the times of their headers, or of the records
// where these have none; it says so. Throws InputError as OpenImages; so does Next, where the
// recording is damaged, or its images are in an encoding that is not read.
std::unique_ptr<ImageSource> OpenRecordedImages(const std::string& path,
                                                const ImageSourceOptions& options);

// All its images with their times, and their names for paths. Throws InputError.
std::vector<ListedImage> TimesOfRecordedImages(const std::string& path,
                                               const ImageSourceOptions& options);

}  // namespace oaslam
