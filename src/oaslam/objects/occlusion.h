#pragma once

#include <span>
#include <vector>

#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Marks as truncated which edges of an object's views are hidden by other mapped objects that stand
// nearer to the camera; its parts, and what it is a part of, hide nothing. `own`: the object's ids.
void MarkHiddenEdges(const Map& map, std::span<const ObjectId> own, const Ellipsoid& ellipsoid,
                     std::vector<BoxView>& views);

}  // namespace oaslam
