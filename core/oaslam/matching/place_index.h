#pragma once

#include <vector>

#include "oaslam/features/descriptor_index.h"
#include "oaslam/map/map.h"

namespace oaslam {

// For each descriptor of an image that was searched, the points of the map with a similar
// descriptor, nearest first. A label is the id of a landmark or, with its highest bit set, of a
// keyframe that alone knows the point.
using LandmarkHits = std::vector<std::vector<DescriptorIndex::Hit>>;

// A keyframe, which comes first, and its closest neighbours, which see the same place.
struct Place {
  std::vector<KeyframeId> keyframes;
  double votes = 0;  // mainly those of the first keyframe
};

Place PlaceAround(const Map& map, KeyframeId keyframe);  // without votes

// Finds landmarks and places of a map by appearance, without a vocabulary: an index of the
// descriptors of their views, and one of the learned descriptors. It is made from one state of the
// map: it lacks landmarks made later, and skips those erased since.
class PlaceIndex {
 public:
  explicit PlaceIndex(const Map& map);

  // The landmarks that look like key points of an image; of many key points, only some are
  // searched.
  LandmarkHits Find(const Features& features, Appearance appearance = Appearance::kOrb) const;

  // Returns up to `count` places with the most votes. Each key point that was searched has one
  // vote, divided equally among the points in its hits; a landmark gives its share to each keyframe
  // that sees it, another point to the keyframe that knows it.
  std::vector<Place> RankPlaces(const Map& map, const LandmarkHits& hits, int count) const;

  size_t size() const { return orb_.size(); }
  bool Has(Appearance appearance) const {
    return (appearance == Appearance::kOrb ? orb_ : learned_).size() > 0;
  }

 private:
  DescriptorIndex orb_, learned_;
};

}  // namespace oaslam
