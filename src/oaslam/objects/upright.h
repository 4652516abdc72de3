#pragma once

#include <Eigen/Core>
#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// The world's up from how people hold cameras: level. Up is the direction in which the cameras' x axes vary least
// (objects-study.md, finding 3: 1.1 deg error on fr2/desk, where the mean of the cameras' up is off by 23 deg). Nothing
// unless the cameras have turned enough about it.
std::optional<Eigen::Vector3d> EstimateUp(const Map& map);

}  // namespace oaslam
