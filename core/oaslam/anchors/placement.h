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

// Why a pose that is given is no place.
extern const char* const kNoPose;

// Finds a place for content. On a mapped object: on its top, upright, facing the ray's origin.
// Without an object: where the ray meets the plane that most landmarks around it fit, landmarks of
// objects excluded; a level plane is preferred where the vertical is known. The result depends on
// map and request only.
Placement FindPlace(const Map& map, const AnchorRequest& request);

// An anchor at this pose, world_from_anchor, carried by the nearest keyframe; nothing in a map
// without keyframes, or for what is no pose (Rigid3::IsValid).
std::optional<Anchor> AnchorAt(const Map& map, const Rigid3& pose);

}  // namespace oaslam
