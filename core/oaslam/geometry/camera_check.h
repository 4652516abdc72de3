#pragma once

#include <string>

#include "oaslam/camera.h"

namespace oaslam {

// Which parameter of a camera is impossible, with its value and bounds; an empty text where none
// is.
std::string ProblemOf(const Camera& camera);

}  // namespace oaslam
