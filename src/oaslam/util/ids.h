#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace oaslam {

// An id that cannot be mistaken for one of another kind. Ascending in order of creation, never
// reused.
template <typename Tag>
struct StrongId {
  static constexpr uint32_t kInvalid = UINT32_MAX;
  uint32_t value = kInvalid;

  constexpr StrongId() = default;
  constexpr explicit StrongId(uint32_t v) : value(v) {}
  constexpr bool IsValid() const { return value != kInvalid; }
  constexpr auto operator<=>(const StrongId&) const = default;
};

using KeyframeId = StrongId<struct KeyframeTag>;
using LandmarkId = StrongId<struct LandmarkTag>;
using ObjectId = StrongId<struct ObjectTag>;

}  // namespace oaslam

template <typename Tag>
struct std::hash<oaslam::StrongId<Tag>> {
  size_t operator()(oaslam::StrongId<Tag> id) const { return std::hash<uint32_t>{}(id.value); }
};
