#pragma once

#include <vector>

#include "oaslam/map/next_ids.h"
#include "oaslam/map/submap.h"

namespace oaslam {

// How the numbers of a map change so that it can be joined with another one.
struct Renumbering {
  NextIds first;                 // added to each id
  int first_frame = 0;           // added to the indices of frames
  std::vector<Camera> cameras;   // of the new map
  std::vector<int> camera_of{};  // the index in `cameras` of each camera of the old map
};

// The same submap with other ids: `first` is added to each.
Submap Renumbered(const Submap& submap, const NextIds& first);

// The same submap with other numbers. Invalid ids stay invalid.
Submap Renumbered(const Submap& submap, const Renumbering& numbers);

}  // namespace oaslam
