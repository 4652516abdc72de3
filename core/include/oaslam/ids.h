#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

namespace oaslam {

// An id that cannot be mistaken for one of another kind. Ids ascend in the order of creation and
// are never used again in the same map. A default one is of nothing.
template <typename Tag>
struct StrongId {
  static constexpr uint32_t kInvalid = UINT32_MAX;
  uint32_t value = kInvalid;

  constexpr StrongId() = default;
  // The number as in files and arrays.
  constexpr explicit StrongId(uint32_t v) : value(v) {}
  // Whether it may be of something.
  constexpr bool IsValid() const { return value != kInvalid; }
  // By the order of creation.
  constexpr auto operator<=>(const StrongId&) const = default;
};

// "7"; "none" where it is invalid.
template <typename Tag>
std::string ToString(StrongId<Tag> id) {
  return id.IsValid() ? std::to_string(id.value) : "none";
}
// The same.
template <typename Tag>
std::ostream& operator<<(std::ostream& stream, StrongId<Tag> id) {
  return stream << ToString(id);
}

// Of an image whose key points are in the map.
using KeyframeId = StrongId<struct KeyframeTag>;
// Of a point of the map.
using LandmarkId = StrongId<struct LandmarkTag>;
// Of an object of the map.
using ObjectId = StrongId<struct ObjectTag>;

// A frame of reference and unit in which poses, landmarks, objects and anchors are given. No two
// maps that a program begins or loads share one, copies of a map do. A camera that is lost may go
// on in a new world (not while the map has anchors, was loaded or is in metres). SetMetresPerUnit
// begins a new one, too.
// Coordinates in two worlds have nothing in common.
using WorldId = StrongId<struct WorldTag>;

}  // namespace oaslam

// So that ids are keys of unordered containers.
template <typename Tag>
struct std::hash<oaslam::StrongId<Tag>> {
  // Of the number.
  size_t operator()(oaslam::StrongId<Tag> id) const { return std::hash<uint32_t>{}(id.value); }
};
