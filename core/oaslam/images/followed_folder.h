#pragma once

#include <memory>
#include <string>

#include "oaslam/image_source.h"

namespace oaslam {

// A file of this name in a followed folder ends the source.
inline constexpr const char* kStopFile = "stop";

// The images of a folder, and those written or moved to it later: first the present ones in natural
// order, or by time where their names are times; then each new one when its file is closed. The
// source ends by the stop file, by options.follow, or when the folder is removed. Needs
// options.follow.
std::unique_ptr<ImageSource> FollowFolder(const std::string& folder,
                                          const ImageSourceOptions& options);

}  // namespace oaslam
