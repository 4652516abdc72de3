#pragma once

#include <vector>

#include "oaslam/map/next_ids.h"
#include "oaslam/map/piece.h"

namespace oaslam {

// How the numbers of a map change so that it can be joined with another one.
struct Renumbering {
  NextIds first;                 // added to each id
  int first_frame = 0;           // added to the indices of frames
  std::vector<Camera> cameras;   // of the new map
  std::vector<int> camera_of{};  // the index in `cameras` of each camera of the old map
};

// The same piece with other ids: `first` is added to each.
Piece Renumbered(const Piece& piece, const NextIds& first);

// The same piece with other numbers. Invalid ids stay invalid.
Piece Renumbered(const Piece& piece, const Renumbering& numbers);

}  // namespace oaslam
