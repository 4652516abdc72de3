#include "oaslam/objects/description.h"

#include <fmt/format.h>

namespace oaslam {

std::string NameForLog(ObjectId id, const Object& object) {
  return object.name.empty()
             ? fmt::format("object {} (class {})", id.value, object.category_id)
             : fmt::format("object {} ({}, class {})", id.value, object.name, object.category_id);
}

}  // namespace oaslam
