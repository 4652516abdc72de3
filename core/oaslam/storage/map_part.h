#pragma once

#include <string>

#include "oaslam/storage/sqlite.h"

namespace oaslam {

// Ids of a table, both ends included.
struct IdRange {
  uint32_t first = 0, last = RowReader::kMaxId;
};

// A part of a map file: a row of the table `parts`. Its checksum is over the rows of its tables.
struct MapPart {
  std::string name;
  IdRange ids;  // of keyframes or landmarks, the number of a submap, or all
  std::string checksum;
};

}  // namespace oaslam
