#pragma once

#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The variance of the logarithm of the scale of one keyframe relative to another, as the odometry
// knows it. Nothing where the camera did not go straight from one to the other: where it came back,
// landmarks tell more.
std::optional<double> ScaleVarianceByOdometry(const Keyframe& one, const Keyframe& other);

}  // namespace oaslam
