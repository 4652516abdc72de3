#pragma once

#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The variance of the logarithm of the scale of one keyframe relative to another that was made soon
// before or after it, as the odometry told it. Nothing for another run or another time, and where
// the odometry does not tie them: where they share no landmark, and no motion leads to the later
// one.
std::optional<double> ScaleVarianceByOdometry(const Keyframe& one, const Keyframe& other,
                                              int shared);

// Before other films come to the same map, whose odometry counts its runs anew.
void ForgetScaleDrift(Map& map);

}  // namespace oaslam
