#pragma once

#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/matching/place_index.h"

namespace oaslam {

struct PlaceMatch {
  int keypoint = 0;  // of the image
  LandmarkId landmark;
  int distance = 0;  // Hamming
};

// Matches an image with all landmarks of a place. A match is mutual: among all views that the
// place's keyframes have of its landmarks, the key point's nearest is one of the landmark, and
// among the image's key points it is the landmark's nearest. The changes of orientation are
// consistent. Sorted by distance.
std::vector<PlaceMatch> MatchPlace(const Features& features, const Map& map, const Place& place);

}  // namespace oaslam
