#pragma once

#include <map>
#include <string>
#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/map/map.h"

namespace oaslam {

using Anchors = std::map<std::string, Anchor>;

// Adds an anchor to those of the map, by its name; `anchors` become those with it.
AnchorReport PlaceAnchor(const Map& map, const AnchorRequest& request, Anchors& anchors);

// Changes an anchor. Returns why it cannot be, or an empty text.
std::string EditAnchor(const std::string& name, const AnchorEdit& edit, Anchors& anchors);

// Where the map's anchors are now, in the order of their names.
std::vector<AnchorPose> PosesOf(const Map& map);

}  // namespace oaslam
