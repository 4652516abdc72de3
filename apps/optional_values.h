#pragma once

#include <string>
#include <vector>

#include "oaslam/map_viewer.h"

namespace oaslam::apps {

constexpr int kViewerPort = MapViewerOptions::kDefaultPort;

// The arguments of the command, in reverse order as CLI11 wants them, with the values of --viewer
// and --follow filled in. Their value is a number and may be left out, but CLI11 would take the
// next argument for it, such as the images in `oaslam run --viewer walk.mp4`.
std::vector<std::string> WithOptionalValues(int argc, const char* const* argv);

}  // namespace oaslam::apps
