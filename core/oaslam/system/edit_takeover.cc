#include "oaslam/system/edit_takeover.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "oaslam/error.h"
#include "oaslam/objects/object_edit.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

const Anchor* FindAnchor(const Anchors& anchors, const std::string& name) {
  const auto found = anchors.find(name);
  return found == anchors.end() ? nullptr : &found->second;
}

bool AreEqual(const Anchor* a, const Anchor* b) { return a && b ? *a == *b : a == b; }

// The factor by which loops have multiplied lengths at a keyframe since the map was read.
double UnitAt(const Map& map, KeyframeId id) {
  if (const Keyframe* keyframe = map.keyframes.Find(id)) return keyframe->unit;
  if (const RetiredKeyframe* retired = map.retired.Find(id)) return retired->unit;
  throw BadInput("the map has no keyframe {} any more, on which an anchor was placed", id.value);
}

Anchor InUnitOf(const Map& map, Anchor anchor) {
  anchor.Scale(UnitAt(map, anchor.keyframe));
  return anchor;
}

// Whether the anchors are one but for what rounding does to their lengths.
bool IsSame(const Anchor& a, const Anchor& b) {
  constexpr double kRounding = 1e-9;  // relative
  return a.model == b.model && a.keyframe == b.keyframe && a.object == b.object &&
         std::abs(a.size - b.size) <= kRounding * a.size &&
         a.offset.isApprox(b.offset, kRounding) &&
         a.cam_from_anchor.translation.isApprox(b.cam_from_anchor.translation, kRounding) &&
         a.cam_from_anchor.rotation.coeffs() == b.cam_from_anchor.rotation.coeffs();
}

void TakeOverAnchor(const std::string& name, const Anchor* read, const Anchor* now, Map& map) {
  if (AreEqual(read, now)) return;
  const Anchor* own = FindAnchor(map.anchors, name);
  if (own && now && IsSame(*own, InUnitOf(map, *now))) return;  // both made the same edit
  const bool is_own_edit =
      read && own ? !IsSame(*own, InUnitOf(map, *read)) : (read != nullptr) != (own != nullptr);
  if (!now) {
    if (!is_own_edit) map.anchors.erase(name);
    return;
  }
  std::string free_name = name;
  if (is_own_edit && own)
    for (int i = 2; map.anchors.contains(free_name); ++i)
      free_name = fmt::format("{} ({})", name, i);
  if (free_name != name)
    Log(LogLevel::kWarning,
        "anchor \"{}\" was edited twice at the same time: the one of the map file is now \"{}\"",
        name, free_name);
  map.anchors[free_name] = InUnitOf(map, *now);
}

void TakeOverAnchors(const EditedContent& read, const Map& now, Map& map) {
  if (now.anchors != read.anchors && read.is_metric != map.is_metric)
    throw InputError("the anchors have another unit than the map");
  for (const auto& [name, anchor] : read.anchors)
    TakeOverAnchor(name, &anchor, FindAnchor(now.anchors, name), map);
  for (const auto& [name, anchor] : now.anchors)
    if (!read.anchors.contains(name)) TakeOverAnchor(name, nullptr, &anchor, map);
}

// What has become in the file of an object that the program read; nothing: no edit.
std::optional<ObjectEdit> EditOf(ObjectId id, const std::string& name, const Map& now) {
  if (const Object* object = now.objects.Find(id))
    return object->name == name ? std::nullopt : std::optional(ObjectEdit{.name = object->name});
  return ObjectEdit{.remove = true};
}

void TakeOverObject(ObjectId id, const std::string& name, const Map& now,
                    const ObjectsConfig& config, Map& map) {
  const std::optional<ObjectEdit> edit = EditOf(id, name, now);
  if (!edit) return;
  const std::optional<ObjectId> own = map.ResolveObject(id);
  const Object* object = own ? map.objects.Find(*own) : nullptr;
  if (!object || object->state != ObjectState::kMapped) {
    if (edit->name)
      Log(LogLevel::kWarning, "object {} was named \"{}\", but is no longer in the map", id.value,
          *edit->name);
    return;
  }
  // A duplicate that the program has merged is removed already.
  const bool is_done = edit->name ? object->name != name : *own != id;
  if (is_done) return;
  EditObject(map, *own, *edit, config);
}

void TakeOverObjects(const EditedContent& read, const Map& now, const ObjectsConfig& config,
                     Map& map) {
  // An object that was merged is not one that was removed.
  std::map<ObjectId, std::string> names = read.names;
  for (const auto& [id, name] : read.names) {
    const ObjectId* into = now.objects.Contains(id) ? nullptr : now.merged_objects.Find(id);
    if (!into) continue;
    names.erase(id);
    const std::optional<ObjectId> own = map.ResolveObject(id), other = map.ResolveObject(*into);
    if (own && other && *own != *other) EditObject(map, *other, {.same_as = *own}, config);
  }
  for (const auto& [id, name] : names) TakeOverObject(id, name, now, config, map);
}

}  // namespace

EditedContent EditedContentOf(const Map& map) {
  EditedContent content{map.anchors, {}, map.is_metric};
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state == ObjectState::kMapped) content.names[id] = object.name;
  });
  return content;
}

std::string TakeOverEdits(const EditedContent& read, const Map& now, const ObjectsConfig& config,
                          Map& map) try {
  Map edited = map;  // shares its tables
  TakeOverObjects(read, now, config, edited);
  TakeOverAnchors(read, now, edited);
  map = std::move(edited);
  return "";
} catch (const InputError& error) {
  return error.what();
}

}  // namespace oaslam
