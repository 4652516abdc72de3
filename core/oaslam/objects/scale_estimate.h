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

// Why the usual sizes of the objects contradict the unit of a map that was given otherwise; empty
// where they do not. `estimate`: of the map in this unit.
std::string ContradictionOfUnit(const ScaleEstimate& estimate);

}  // namespace oaslam
