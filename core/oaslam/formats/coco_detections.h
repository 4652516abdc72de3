#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "oaslam/formats/detection_input.h"

namespace oaslam {

// Reads a list of COCO results, or COCO's annotations with the images' names. `path`: of the file,
// for messages; a file with the names may lie beside it. Throws InputError.
DetectionFile ReadCoco(const nlohmann::json& root, const std::string& path);

}  // namespace oaslam
