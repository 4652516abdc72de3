#pragma once

#include <map>
#include <optional>
#include <string>

#include "oaslam/class_relations.h"
#include "oaslam/export.h"

namespace oaslam {

// category_id -> name.
using ClassNames = std::map<int, std::string>;

OASLAM_API const ClassNames& CocoClassNames();  // the 80 of COCO, ids 0..79

// What a class file says of the classes of a detector.
struct Classes {
  ClassNames names;
  ClassRelations relations;
};
// Loads a class file (docs/formats.md): YAML with names, parts and movable, or a text file with a
// name in each line. Throws InputError.
OASLAM_API Classes LoadClasses(const std::string& path);

// Returns a category that `whole_of` makes a part of itself, directly or through others; nothing if
// there is none.
OASLAM_API std::optional<int> PartOfItself(const std::map<int, int>& whole_of);
// The name, or "class 41".
OASLAM_API std::string NameOf(const ClassNames& names, int category_id);

}  // namespace oaslam
