#pragma once

#include <stop_token>
#include <vector>

#include "oaslam/bundle/bundle_adjustment.h"

namespace oaslam {

// What to optimise, all lists ascending and without repeats.
struct BundleSelection {
  std::vector<KeyframeId> free_keyframes;
  std::vector<KeyframeId> fixed_keyframes;
  std::vector<LandmarkId> landmarks;  // with their observations by all these keyframes
  std::vector<ObjectId> objects;      // with all their observations
  bool free_objects = false;          // the ellipsoids are optimised, too
};

struct BundleEffort {
  int iterations = 10;      // at most
  double tolerance = 1e-3;  // a stage ends with a step that lowers the cost by less than this share
  std::stop_token stop{};   // when requested, the solver gives up
};

// Solves in two stages of at most half the iterations each, the second without outliers.
BundleCorrection SolveBundle(const Map& map, const BundleSelection& selection,
                             const BundleEffort& effort);

}  // namespace oaslam
