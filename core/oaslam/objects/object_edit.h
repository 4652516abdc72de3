#pragma once

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/object_edit.h"

namespace oaslam {

// Applies a user's change to an object. Throws InputError, and changes nothing, as EditObject of
// map_editing.h says.
void EditObject(Map& map, ObjectId id, const ObjectEdit& edit, const ObjectsConfig& config);

}  // namespace oaslam
