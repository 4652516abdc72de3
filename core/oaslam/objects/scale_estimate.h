#pragma once

#include <map>
#include <string>

#include "oaslam/map/map.h"
#include "oaslam/scale_estimate.h"

namespace oaslam {

// Estimates the length of the map's unit from its mapped objects and the usual sizes of their
// classes (docs/objects.md#usual-sizes). `names`: of the categories of the objects. Fails where
// fewer than three objects of three classes agree, where others agree on another unit, where the
// vertical is not known, and where the camera would have been out of a person's reach.
ScaleEstimate EstimateScale(const Map& map, const std::map<int, std::string>& names);

// Describes how the usual sizes of objects contradict a metre that was determined in another way;
// empty where they do not. `estimate`: EstimateScale of the map after it was scaled to that metre.
std::string ContradictionOfUnit(const ScaleEstimate& estimate);

}  // namespace oaslam
