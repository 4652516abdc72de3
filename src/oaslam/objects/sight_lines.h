#pragma once

#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// Keyframes and those each of them shares most landmarks with.
std::vector<KeyframeId> WithNeighbors(const Map& map, std::span<const KeyframeId> keyframes);

// What the sight lines from keyframes to their landmarks show of a thing that fills an ellipsoid.
struct SightLines {
  int through = 0;  // landmarks seen well behind it, through its middle
  int stopped = 0;  // landmarks seen on it, where its middle is
};

// Counts landmarks, each once. Lines that pass the middle half of the ellipsoid are looked at only,
// since its outline is uncertain.
SightLines CountSightLines(const Map& map, const Ellipsoid& ellipsoid,
                           std::span<const KeyframeId> keyframes);

// The log-likelihood ratio that an object is gone, against it is there, of the sight lines from
// those of the keyframes that are newer than its last detection; nats. How often one looks through
// it while it is there (chairs, glasses) is known from the keyframes that detected it. 0 where less
// than four fifths of the lines pass, since something is there then, and where the keyframes of
// both times have too few landmarks in common to tell its place.
double SeenThroughEvidence(const Map& map, const Object& object,
                           std::span<const KeyframeId> keyframes);

}  // namespace oaslam
