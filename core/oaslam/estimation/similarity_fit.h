#pragma once

#include <optional>
#include <span>
#include <vector>

#include "oaslam/geometry/similarity.h"

namespace oaslam {

struct ScalePrior {
  double scale = 1;
  double relative_sigma = 1;
};

// The poses of one camera in two maps.
struct PosePair {
  Rigid3 cam_from_a, cam_from_b;
  double sigma = 1;  // standard deviation of its position in b, map units
  // The ratio of lengths in b to lengths in a, by points whose depth from this camera is known in
  // both maps.
  std::optional<ScalePrior> scale{};
};

struct SimilarityFit {
  bool success = false;
  Similarity b_from_a;
  // By pair, on success: position and scale within three sigmas and rotation within a few degrees.
  std::vector<bool> is_inlier;
  int inliers = 0;
  double relative_sigma = 0;  // of the scale
};

// Estimates the similarity that maps a to b from cameras with a pose in both, most of which must
// agree. Cameras that hardly moved do not determine the scale: see `relative_sigma`. Without a
// prior of the scale, from the caller or a pair, there must be three cameras.
SimilarityFit FitSimilarity(std::span<const PosePair> pairs,
                            const std::optional<ScalePrior>& prior = std::nullopt);

}  // namespace oaslam
