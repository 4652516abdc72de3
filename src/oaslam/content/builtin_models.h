#pragma once

#include <string>
#include <utility>
#include <vector>

#include "oaslam/content/mesh.h"

namespace oaslam {

// Content that is always there, made in code: "flag", "arrow" (its tip on the place), "cube" (a
// crate), "tree", "robot". Their longest side is 1, and they stand in the middle of their bounds.
const std::vector<std::pair<std::string, Mesh>>& BuiltinModels();

// The edges of a cube of side 1 that stands on the origin: stands for a model that is not there.
const Mesh& PlaceholderModel();

}  // namespace oaslam
