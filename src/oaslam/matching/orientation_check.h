#pragma once

#include <vector>

namespace oaslam {

// Which of the matches turn together: the angle differences fall into 30 bins, those of the three
// fullest stay (the second and third only if they hold at least a tenth of the first).
std::vector<char> ConsistentOrientations(const std::vector<float>& angle_differences_rad);

}  // namespace oaslam
