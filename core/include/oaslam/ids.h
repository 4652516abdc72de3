#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

namespace oaslam {

// An id that cannot be mistaken for one of another kind. Ids ascend in the order of creation and
// are never used again in the same map. A default-constructed id is invalid: it identifies nothing.
template <typename Tag>
struct StrongId {
  static constexpr uint32_t kInvalid = UINT32_MAX;
  uint32_t value = kInvalid;

  constexpr StrongId() = default;
  // The number as in files and arrays.
  constexpr explicit StrongId(uint32_t v) : value(v) {}
  // Whether the id is valid; the element that it identifies may be erased.
  constexpr bool IsValid() const { return value != kInvalid; }
  // By the order of creation.
  constexpr auto operator<=>(const StrongId&) const = default;
};

// "7"; "none" where it is invalid.
template <typename Tag>
std::string ToString(StrongId<Tag> id) {
  return id.IsValid() ? std::to_string(id.value) : "none";
}
// Writes an id as ToString does.
template <typename Tag>
std::ostream& operator<<(std::ostream& stream, StrongId<Tag> id) {
  return stream << ToString(id);
}

// The id of a keyframe: an image whose key points are in the map.
using KeyframeId = StrongId<struct KeyframeTag>;
// The id of a landmark: a point of the map.
using LandmarkId = StrongId<struct LandmarkTag>;
// The id of an object of the map.
using ObjectId = StrongId<struct ObjectTag>;

// A frame of reference and unit in which poses, landmarks, objects and anchors are given. No two
// maps that a program begins or loads share a world; copies of one map share its world. Slam may
// continue with a lost camera in a new world, unless the map has anchors, was loaded or is in
// metres. Slam::SetMetresPerUnit begins a new world, too. Coordinates in two worlds have nothing in
// common.
using WorldId = StrongId<struct WorldTag>;

}  // namespace oaslam

// This hash lets ids be keys of unordered containers.
template <typename Tag>
struct std::hash<oaslam::StrongId<Tag>> {
  // Of the number.
  size_t operator()(oaslam::StrongId<Tag> id) const { return std::hash<uint32_t>{}(id.value); }
};
