#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// The detections of one image, a list as in OA-SLAM's JSON. `where`: what the list is, for
// messages. Throws InputError.
std::vector<Detection> DetectionsFromJson(const nlohmann::json& list, const std::string& where);

}  // namespace oaslam
