#pragma once

#include <vector>

#include "oaslam/features/descriptor_index.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Per key point of an image: landmarks with a similar descriptor, nearest first. Labels are ids of
// landmarks.
using LandmarkHits = std::vector<std::vector<DescriptorIndex::Hit>>;

// A keyframe and its closest neighbours, which see the same place.
struct Place {
  std::vector<KeyframeId> keyframes;  // the first one gave it its votes
  double votes = 0;
};

// Finds landmarks and places of a map by appearance, without a vocabulary. A snapshot: landmarks
// made later are not in it, those erased since are skipped.
class PlaceIndex {
 public:
  explicit PlaceIndex(const Map& map);

  LandmarkHits Find(const Features& features) const;

  // Up to `count` places with the most votes. Each key point has one vote, shared by the landmarks
  // that look like it; a landmark hands its share to all keyframes that see it.
  std::vector<Place> RankPlaces(const Map& map, const LandmarkHits& hits, int count) const;

  size_t size() const { return index_.size(); }

 private:
  DescriptorIndex index_;
};

}  // namespace oaslam
