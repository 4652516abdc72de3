#pragma once

#include <optional>
#include <string>

#include "oaslam/anchors.h"
#include "oaslam/map/map.h"

namespace oaslam {

struct Placement {
  std::optional<Anchor> anchor;
  std::string why_not;  // where there is none
};

// Why content cannot have this size (map units); empty if it can.
std::string ProblemOfSize(double size);

// Where a ray meets the plane of the landmarks around it.
struct MapSurface {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  KeyframeId keyframe;  // that sees most of the plane's landmarks
};
// The plane fitted to most landmarks in a cone around the ray, landmarks of mapped objects
// excluded. Cones of 2, 4, 8 and 16 degrees are tried, and the narrowest one with enough landmarks
// in a plane is used. `direction` has length 1.
std::optional<MapSurface> SurfaceAlong(const Map& map, const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& direction);

// The message that refuses a pose at which no anchor can be placed.
extern const char* const kNoPose;

// Finds a place for content. On a mapped object: on its top, upright, facing the ray's origin.
// Without an object: where the ray meets the plane that most landmarks around it fit, landmarks of
// objects excluded; a level plane is preferred where the vertical is known. The result depends on
// map and request only.
Placement FindPlace(const Map& map, const AnchorRequest& request);

// An anchor at this pose, world_from_anchor, relative to the nearest keyframe; nothing in a map
// without keyframes, or for a pose that is not valid (Rigid3::IsValid).
std::optional<Anchor> AnchorAt(const Map& map, const Rigid3& pose);

}  // namespace oaslam
