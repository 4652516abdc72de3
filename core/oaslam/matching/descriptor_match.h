#pragma once

#include <span>
#include <utility>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/map/map.h"
#include "oaslam/matching/projection_search.h"

namespace oaslam {

// Pairs of key points (first image, second image).
using KeypointPairs = std::vector<std::pair<int, int>>;

// Matches for the initialisation: each key point of the first image is searched within `window_px`
// of its `expected` position, on about the same level.
KeypointPairs MatchWithinWindow(const Features& first, const Features& second,
                                std::span<const Eigen::Vector2d> expected, double window_px,
                                double ratio);

// Matches for triangulation: key points without a landmark in either keyframe that agree with the
// epipolar geometry.
KeypointPairs MatchAlongEpipolarLines(const Map& map, const Keyframe& first,
                                      const Keyframe& second);

}  // namespace oaslam
