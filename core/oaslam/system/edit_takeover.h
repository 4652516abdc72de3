#pragma once

#include <map>
#include <optional>
#include <string>

#include "oaslam/anchors/editing.h"
#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What users edit in a map, by the command or in a page: its anchors, and the names of its objects.
struct EditedContent {
  Anchors anchors;
  std::map<ObjectId, std::string> names;  // of all that are mapped; empty: that of the class
  bool is_metric = false;                 // the unit of the anchors
};
EditedContent EditedContentOf(const Map& map);

// Takes over what users have edited in a map file while a program worked on the map that it had
// read from it. `read`: what the program read; `now`: what the file has, a map with the same
// keyframes; `map`: what the program made of it, with the lengths that loops have changed since.
// Returns why that is not possible, or an empty text; then `map` is unchanged.
//
// Of an anchor that both have changed, both stay, that of the file under a free name; of an object
// that both have named, the program's name stays. Of an object that the program no longer has,
// nothing is taken over, with a warning.
std::string TakeOverEdits(const EditedContent& read, const Map& now, const ObjectsConfig& config,
                          Map& map);

}  // namespace oaslam
