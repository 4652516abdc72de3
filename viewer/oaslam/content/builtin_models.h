#pragma once

#include <string_view>

namespace oaslam {

// The built-in models (data/content), as files of binary glTF: y up, the front towards +z. Their
// longest side is 1, and the centre of their bottom is at the origin; the tip of the arrow is
// there.
std::string_view FlagModel();
std::string_view ArrowModel();
std::string_view CubeModel();  // a crate
std::string_view TreeModel();
std::string_view RobotModel();

}  // namespace oaslam
