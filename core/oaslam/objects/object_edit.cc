#include "oaslam/objects/object_edit.h"

#include <algorithm>

#include "oaslam/objects/object_merging.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

ObjectId MappedObject(const Map& map, ObjectId id) {
  const std::optional<ObjectId> now = map.ResolveObject(id);
  if (!now || map.objects.At(*now).state != ObjectState::kMapped)
    throw BadInput("the map has no object {}", id.value);
  return *now;
}

void CheckName(const std::string& name) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; };
  if (std::ranges::any_of(name, is_control))
    throw InputError("the name of an object has no control character");
}

}  // namespace

void EditObject(Map& map, ObjectId id, const ObjectEdit& edit, const ObjectsConfig& config) {
  const ObjectId object = MappedObject(map, id);
  if (edit.name) CheckName(*edit.name);
  if (edit.same_as) {
    const ObjectId other = MappedObject(map, *edit.same_as);
    if (other == object)
      throw BadInput("objects {} and {}: both ids are of one object", id.value,
                     edit.same_as->value);
    if (!MergeObjects(map, object, other, config))
      throw BadInput(
          "objects {} and {} are not merged: they are of two classes, or no ellipsoid can be "
          "fitted "
          "to the boxes of both",
          id.value, edit.same_as->value);
  }
  if (edit.name) map.objects.MutableAt(object).name = *edit.name;
  if (edit.remove) map.objects.Erase(object);
}

}  // namespace oaslam
