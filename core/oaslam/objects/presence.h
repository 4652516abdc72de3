#pragma once

#include <span>

#include "oaslam/map/map.h"

namespace oaslam {

// Whether a frame shows that a mapped object is in its place.
enum class PlaceEvidence { kNone, kInPlace, kAbsent };

// The interval between images, in seconds, where time stamps do not tell it.
constexpr double kVideoInterval = 1.0 / 30;

// The log-likelihood ratio, given one frame, of "the object is gone" against "the object is there
// and detected at its usual rate". Detectors miss an object for several images in a row, so that
// half a second counts as one view; an image counts for its share of that.
double AbsenceEvidence(PlaceEvidence evidence, double interval_s, const Object& object);

// Adds the evidence of a frame to Object::absence, which never falls below 0 (Page's cumulative
// sum, 1954).
void WeighPlace(PlaceEvidence evidence, double interval_s, Object& object);

// Whether the evidence suffices to act on it.
bool IsProvenAbsent(double absence);

// Whether the object was detected from about this side and distance before. A missing detection
// does not count elsewhere, since the detector may not recognise the object from there.
bool WasSeenFrom(const Map& map, const Object& object, const Rigid3& cam_from_world);

// An upper bound on the share of a box that others hide, at most 1.
double HiddenShare(const Box& box, std::span<const Box> nearer);
// Largest hidden share at which an object is expected to be detected. A larger share would count
// hidden objects as missing, a smaller one would leave fewer images with evidence.
constexpr double kMaxHiddenShare = 0.3;

}  // namespace oaslam
