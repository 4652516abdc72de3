#pragma once

#include <string_view>
#include <vector>

#include "oaslam/image_features.h"

namespace oaslam {

// The key points that a client has taken of an image (docs/service.md), each first with its place
// and angle, then all levels, then all descriptors. Throws InputError where there are not `count`
// of them.
std::vector<ImageFeature> ReadReceivedFeatures(std::string_view bytes, int count);

}  // namespace oaslam
