#pragma once

#include <string>

#include "oaslam/map/map.h"

namespace oaslam {

// For the log: "object 7 (class 41)".
std::string NameForLog(ObjectId id, const Object& object);

}  // namespace oaslam
