#pragma once

#include <span>

#include "oaslam/map/map.h"

namespace oaslam {

// What a frame says of whether a mapped object is where the map has it.
enum class PlaceEvidence { kNone, kInPlace, kAbsent };

// Seconds between two images where these say nothing else.
constexpr double kVideoInterval = 1.0 / 30;

// The logarithm of how much more likely a frame is if the object is gone than if it is there and
// detected at its own rate. Misses come in runs: half a second counts as one view, of which the
// image has the share that lies since the one before.
double AbsenceEvidence(PlaceEvidence evidence, double interval_s, const Object& object);

// Adds a frame to Object::absence, the evidence of the frames since it may have gone; never below 0
// (Page's cumulative sum, 1954).
void WeighPlace(PlaceEvidence evidence, double interval_s, Object& object);

// Enough evidence to act.
bool IsProvenAbsent(double absence);

// Whether it was detected from about this side and distance before: what a detector does not know
// from elsewhere is not missed there.
bool WasSeenFrom(const Map& map, const Object& object, const Rigid3& cam_from_world);

// The share of a box that others may hide, at most 1.
double HiddenShare(const Box& box, std::span<const Box> nearer);
constexpr double kMaxHiddenShare = 0.3;  // of an object that is expected to be detected

}  // namespace oaslam
