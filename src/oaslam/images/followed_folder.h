#pragma once

#include <memory>
#include <string>

#include "oaslam/images/image_source.h"

namespace oaslam {

// Name of the file whose appearance in a followed folder says that no more images come.
inline constexpr const char* kStopFile = "stop";

// The images of a folder, and those that are written or moved to it later, each when it is closed:
// first those that are there, in natural order, then as they come. Ends by the stop file, by
// options.follow, or when the folder goes. Needs options.follow.
std::unique_ptr<ImageSource> FollowFolder(const std::string& folder,
                                          const ImageSourceOptions& options, double fps);

}  // namespace oaslam
