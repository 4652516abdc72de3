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

// Empty where content may be so large, in map units.
std::string ProblemOfSize(double size);

// Where content stands that is put on a mapped object: on its top, upright, facing the ray's
// origin. On none: where the ray meets the plane that most landmarks about it agree on, those of
// objects aside; a level one before others, where up is known. The same for the same map and
// request.
Placement FindPlace(const Map& map, const AnchorRequest& request);

}  // namespace oaslam
