#pragma once

#include <optional>
#include <vector>

#include "oaslam/features/depth_map.h"
#include "oaslam/geometry/box.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What a depth camera tells of the objects in an image.

// The length of a metre in map units, by the landmarks in view whose depth was measured; nothing
// where these are few.
std::optional<double> UnitsPerMetre(const TrackedFrame& tracked, const Map& map);

// The median z, in metres, of the nearest surface that fills much of a box of the ideal image: that
// of the object, not of what is behind it or covers a small part of it. Nothing where too little of
// the box was measured.
std::optional<double> SurfaceIn(const Box& box, const Camera& camera, const DepthMap& depth);

// The detections of a frame, with the surfaces that their boxes show where the map has a metre that
// is known (SigmaOfMetre).
std::vector<ObjectDetection> WithSurfaces(const Frame& frame, const Map& map);

}  // namespace oaslam
