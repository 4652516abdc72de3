#pragma once

#include <span>

#include "oaslam/map/map.h"

namespace oaslam {

// What a frame says of whether a mapped object is where the map has it.
enum class PlaceEvidence { kNone, kInPlace, kAbsent };

// Adds a frame to Object::absence, the logarithm of how much more likely the frames since are if
// the object is gone than if it is there and detected at its own rate; never below 0 (Page's
// cumulative sum, 1954). Misses come in runs: 15 frames count as one view.
void WeighPlace(PlaceEvidence evidence, Object& object);

// Enough of it to act.
bool IsProvenAbsent(const Object& object);

// Whether it was detected from about this side and distance before: what a detector does not know
// from elsewhere is not missed there.
bool WasSeenFrom(const Map& map, const Object& object, const Rigid3& cam_from_world);

// The share of a box that others may hide, at most 1.
double HiddenShare(const Box& box, std::span<const Box> nearer);
constexpr double kMaxHiddenShare = 0.3;  // of an object that is expected to be detected

}  // namespace oaslam
