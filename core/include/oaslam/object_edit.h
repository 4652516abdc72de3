#pragma once

#include <optional>
#include <string>

#include "oaslam/ids.h"

namespace oaslam {

// A user's change to an object of a map. Slam::EditObject applies it to the map that is being made,
// EditObject (map_editing.h) to a map as data:
//
//   slam.EditObject(id, {.name = "my mug"});
//   slam.EditObject(id, {.same_as = other});
struct ObjectEdit {
  // The object's new name, without control characters; empty: that of its class.
  std::optional<std::string> name{};
  // Another object of the map that is the same thing. Its boxes go to the edited object. Its id is
  // no longer in the map; anchors and later edits take it for that of the edited object.
  std::optional<ObjectId> same_as{};
  bool remove = false;  // the map forgets the object; what is seen again is mapped anew
};

}  // namespace oaslam
