#pragma once

#include <span>

#include "oaslam/map/map.h"

namespace oaslam {

// Whether a frame shows that a mapped object is in its place. kUnrecognised: it is not detected
// there, but from this side it never was.
enum class PlaceEvidence { kNone, kInPlace, kAbsent, kUnrecognised };

// The interval between images, in seconds, where time stamps do not tell it.
constexpr double kVideoInterval = 1.0 / 30;

// The log-likelihood ratio of a frame: the object is gone, against it is there and detected at its
// usual rate. Detectors miss an object for several images in a row, so that half a second counts as
// one view; an image counts for its share of that.
double AbsenceEvidence(PlaceEvidence evidence, double interval_s, const Object& object);

// Adds the evidence of a frame to Object::absence and absence_from_any_side, which never fall below
// 0 (Page's cumulative sum, 1954). Only the second counts views from sides from which the object
// was never detected: a detector recognises it from every other of these.
void WeighPlace(PlaceEvidence evidence, double interval_s, Object& object);

// Whether the evidence suffices to act on it.
bool IsProvenAbsent(double absence);

// Evidence in nats that a mapped object was not in its place before it was first detected: the sum
// of absence_from_any_side over the earlier keyframes that look at its place and about which
// anything was detected.
double ArrivalEvidence(const Map& map, const Object& object);

// Whether a camera looks at the place of an ellipsoid, and nothing stands in between: it is large
// enough and well inside the image, and most of `landmarks`, which the camera sees, in and
// around its outline are not nearer than the ellipsoid. (A map made of detections alone has no
// landmarks, and does not tell.)
bool LooksAt(const Map& map, const Camera& camera, const Rigid3& cam_from_world,
             std::span<const LandmarkId> landmarks, const Ellipsoid& ellipsoid);

// Whether the object was detected from about this side and distance before. A missing detection
// does not count elsewhere, since the detector may not recognise the object from there.
bool WasSeenFrom(const Map& map, const Object& object, const Rigid3& cam_from_world);

// Share of a projection that must be inside the image for a missing detection to count.
constexpr double kWellInsideShare = 0.8;
// Detector pixels; missing detections of smaller objects do not count.
constexpr double kMinMissedSize = 14;
// The share of a box that others may hide, at most 1.
double HiddenShare(const Box& box, std::span<const Box> nearer);
// Largest hidden share at which an object is expected to be detected.
constexpr double kMaxHiddenShare = 0.3;

}  // namespace oaslam
