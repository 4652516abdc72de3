#pragma once

#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The variance of the logarithm of the scale of one keyframe relative to another that was made soon
// before or after it, by the odometry. `shared`: number of landmarks that both see. Nothing where
// the keyframes are of different runs, or far apart in time, or where they share no landmark and no
// motion leads to the later one.
std::optional<double> ScaleVarianceByOdometry(const Keyframe& one, const Keyframe& other,
                                              int shared);

// Drops the variances of all keyframes. To be called before another recording extends the same map,
// since its odometry counts its runs from 0 again.
void ForgetScaleDrift(Map& map);

}  // namespace oaslam
