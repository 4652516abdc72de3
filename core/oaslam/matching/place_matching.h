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

// Matches an image with all points of a place. A match is mutual: among all views that the place's
// keyframes have of its points, the key point's nearest is one of the point, and among the image's
// key points it is the point's nearest. The changes of orientation are consistent. Sorted by
// distance. With learned descriptors, views of landmarks by other keyframes count, too, since few
// keyframes have them; ORB adds matches of points and key points that have none by these.
std::vector<PlaceMatch> MatchPlace(const Features& features, const Map& map, const Place& place,
                                   Appearance appearance = Appearance::kOrb);

}  // namespace oaslam
