#pragma once

#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"

namespace oaslam {

// What a depth camera adds to a pose that points or objects found, in a map whose metre is known
// (SigmaOfMetre): the pose is moved so that landmarks lie on the surfaces that were measured, and
// refused if the camera sees through the landmarks that it puts in view. Points that end a search
// by their number outvote the depths: things may have been removed. Changes nothing without depths.
void ApplyDepths(const Frame& frame, const Map& map, Relocalization& found);

}  // namespace oaslam
