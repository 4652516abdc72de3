#pragma once

#include <string>
#include <vector>

#include "oaslam/map_viewer.h"

namespace oaslam::apps {

constexpr int kViewerPort = MapViewerOptions::kDefaultPort;

// The arguments of the command, last one first as CLI11 wants them, with the values of --viewer and
// --follow filled in. Their value is a number and may be left out; CLI11 would take the next
// argument for it in any case: the images in `oaslam run --viewer walk.mp4`.
std::vector<std::string> WithOptionalValues(int argc, const char* const* argv);

}  // namespace oaslam::apps
