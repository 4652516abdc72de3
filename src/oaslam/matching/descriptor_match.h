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

// Landmarks that another image shows, found in this one by the other's descriptors alone: nearest
// neighbour, distance ratio, each key point once, orientations turning together. `seen[keypoint of
// from]`: invalid where none.
LandmarkMatches MatchSeenLandmarks(const Features& features, const Map& map, const Features& from,
                                   std::span<const LandmarkId> seen, double ratio);
// The same for a keyframe.
LandmarkMatches MatchKeyframeLandmarks(const Features& features, const Map& map,
                                       const Keyframe& keyframe, double ratio);

// For the initialisation: key points within `window_px` of where those of the first image are
// `expected`, on about the same level.
KeypointPairs MatchWithinWindow(const Features& first, const Features& second,
                                std::span<const Eigen::Vector2d> expected, double window_px,
                                double ratio);

// For triangulation: key points without a landmark in both keyframes that agree with the epipolar
// geometry.
KeypointPairs MatchAlongEpipolarLines(const Map& map, const Keyframe& first,
                                      const Keyframe& second);

}  // namespace oaslam
