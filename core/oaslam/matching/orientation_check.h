#pragma once

#include <vector>

namespace oaslam {

// Tells which matches have consistent changes of orientation: the differences are sorted into 30
// bins, and those in the three fullest are kept (the second and third only if they hold at least a
// tenth of the first).
std::vector<char> ConsistentOrientations(const std::vector<float>& angle_differences_rad);

}  // namespace oaslam
