#pragma once

#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/map/map.h"

namespace oaslam {

// MapSnapshot::Cast. The ray must be finite, and its direction not zero.
std::vector<RayHit> CastRay(const Map& map, const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction);

}  // namespace oaslam
