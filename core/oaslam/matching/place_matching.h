#pragma once

#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/matching/place_index.h"

namespace oaslam {

struct PlaceMatch {
  int keypoint = 0;     // of the image
  LandmarkId landmark;  // invalid: a point that a keyframe alone knows (Keyframe::learned_depths)
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world
  int distance = 0;                                    // Hamming
};

// Matches an image with all points of a place. Matches are mutual nearest neighbours: of all views
// of points in the place's keyframes, the nearest to the key point is a view of the matched point;
// of all key points of the image, the matched one is nearest to the point. The changes of
// orientation are consistent. Sorted by distance. With learned descriptors, views of landmarks by
// other keyframes count, too, since few keyframes have such descriptors; ORB adds matches of points
// and key points that have no match by learned descriptors.
std::vector<PlaceMatch> MatchPlace(const Features& features, const Map& map, const Place& place,
                                   Appearance appearance = Appearance::kOrb);

}  // namespace oaslam
