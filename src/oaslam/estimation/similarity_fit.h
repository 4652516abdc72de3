#pragma once

#include <span>
#include <vector>

#include "oaslam/geometry/similarity.h"

namespace oaslam {

// One camera in two maps.
struct PosePair {
  Rigid3 cam_from_a, cam_from_b;
  double sigma = 1;  // of its position in b, map units
};

struct SimilarityFit {
  bool success = false;
  Similarity b_from_a;
  std::vector<bool> is_inlier;  // per pair, on success: within three sigmas, and a few degrees
  int inliers = 0;
  double relative_sigma = 0;  // of the scale
};

// The similarity that takes map a to map b where most of these cameras coincide; the others may be
// wrong. Cameras that hardly moved do not determine the scale: see `relative_sigma`.
SimilarityFit FitSimilarity(std::span<const PosePair> pairs);

}  // namespace oaslam
