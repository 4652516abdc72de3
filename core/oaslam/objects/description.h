#pragma once

#include <string>

#include "oaslam/map/map.h"

namespace oaslam {

// For the log: "object 7 (class 41)".
std::string Described(ObjectId id, const Object& object);

}  // namespace oaslam
