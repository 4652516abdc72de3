#pragma once

#include <numbers>

namespace oaslam {

inline constexpr double kDegree = std::numbers::pi / 180;  // in rad

}  // namespace oaslam
