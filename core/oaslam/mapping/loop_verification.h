#pragma once

#include <optional>

#include "oaslam/geometry/similarity.h"
#include "oaslam/mapping/loop_closing.h"

namespace oaslam {

// A keyframe that may see the place of the current one, and why.
struct LoopCandidate {
  KeyframeId old;
  bool is_near = false;                       // in position and viewing direction
  std::optional<Similarity> by_objects = {};  // old_from_current
};

// Looks for the landmarks of the old end in the image of `current` (FindAtPlace). Where objects
// propose the loop, it also searches around the pose from objects, which the points must confirm.
// Returns nothing where too few are found.
std::optional<LoopClosure> VerifyLoop(const Map& map, KeyframeId current,
                                      const LoopCandidate& candidate, Rng& rng);

Rigid3 MovedCamera(const Keyframe& keyframe, const Similarity& old_from_current);

}  // namespace oaslam
