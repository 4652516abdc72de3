#pragma once

#include <map>
#include <string>
#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/map/map.h"

namespace oaslam {

using Anchors = std::map<std::string, Anchor>;

// Places content in the map and adds its anchor to `anchors`, which must be those of the map.
AnchorReport PlaceAnchor(const Map& map, const AnchorRequest& request, Anchors& anchors);

AnchorReport EditAnchor(const Map& map, const std::string& name, const AnchorEdit& edit,
                        Anchors& anchors);
AnchorReport RemoveAnchor(const std::string& name, Anchors& anchors);

// The present poses of the map's anchors, in the order of their names.
std::vector<AnchorPose> PosesOf(const Map& map);

}  // namespace oaslam
