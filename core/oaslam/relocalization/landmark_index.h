#pragma once

#include "oaslam/map/map.h"
#include "oaslam/matching/place_index.h"

namespace oaslam {

// An index of the places of a map, and the landmarks from which it was made. All searches in that
// map share it.
struct LandmarkIndex {
  explicit LandmarkIndex(const Map& map) : landmarks(map.landmarks), places(map) {}
  // Whether the map still has the landmarks from which the index was made. Their number and the
  // map's version do not tell this, since another map may have the same.
  bool IsOf(const Map& map) const;

  Table<LandmarkId, Landmark> landmarks;
  PlaceIndex places;
};

}  // namespace oaslam
