#pragma once

#include <string>
#include <utility>
#include <vector>

#include "oaslam/content/mesh.h"

namespace oaslam {

// The built-in models, made in code: "flag", "arrow" (its tip on the place), "cube" (a crate),
// "tree", "robot". Their longest side is 1, and the centre of their bottom is at the origin.
const std::vector<std::pair<std::string, Mesh>>& BuiltinModels();

}  // namespace oaslam
