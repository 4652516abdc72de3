#pragma once

#include <span>
#include <vector>

#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/object_places.h"

namespace oaslam {

// Marks as truncated the edges of an object's views that are hidden by other mapped objects nearer
// to the camera. Parts of the object, and the whole it is a part of, do not count as hiding it.
// `own`: the ids of the object. `places`: of the map's objects; those erased since are skipped.
void MarkHiddenEdges(const Map& map, std::span<const ObjectPlace> places,
                     std::span<const ObjectId> own, const Ellipsoid& ellipsoid,
                     std::vector<BoxView>& views);

}  // namespace oaslam
