#pragma once

#include <vector>

#include "oaslam/bundle/bundle_adjustment.h"

namespace oaslam {

// What to optimise, all lists ascending and without repeats.
struct BundleSelection {
  std::vector<KeyframeId> free_keyframes;
  std::vector<KeyframeId> fixed_keyframes;
  std::vector<LandmarkId> landmarks;  // their observations by all these keyframes count
};

// Solves in two stages of at most half the iterations each.
BundleCorrection SolveBundle(const Map& map, const BundleSelection& selection, int iterations);

}  // namespace oaslam
