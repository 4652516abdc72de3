#pragma once

#include <span>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The keyframes, and for each of them those with which it shares most landmarks.
std::vector<KeyframeId> WithNeighbours(const Map& map, std::span<const KeyframeId> keyframes);

// The evidence of sight lines from keyframes to their landmarks on an object that fills an
// ellipsoid.
struct SightLines {
  int through = 0;  // landmarks seen well behind it, through its middle
  int stopped = 0;  // landmarks seen on it, where its middle is
};

// Counts landmarks, each once, on lines through the middle half of the ellipsoid only, since its
// outline is uncertain.
SightLines CountSightLines(const Map& map, const Ellipsoid& ellipsoid,
                           std::span<const KeyframeId> keyframes);

// The log-likelihood ratio (nats) of "the object is gone" against "it is there", given the sight
// lines from those of the keyframes that are newer than its last detection. The keyframes that
// detected it tell how often lines pass through it while it is there (chairs, glasses). Returns 0
// where less than four fifths of the lines pass, since something still stands there, and where the
// older and the newer keyframes share too few landmarks for its place to be known.
double SeenThroughEvidence(const Map& map, const Object& object,
                           std::span<const KeyframeId> keyframes);

}  // namespace oaslam
