#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/rigid3.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct AbsolutePoseOptions {
  int max_iterations = 1000;  // enough for a share of inliers of a fifth (IterationsFor)
  // Bound for inliers within RANSAC: three sigmas, wider than the final bound of 5.991, since a
  // pose from three noisy points is rough.
  double max_chi2 = 9;
  int min_inliers = 10;  // three points always fit: seven others must agree
};

struct AbsolutePoseReport {
  bool success = false;
  Rigid3 cam_from_world;
  std::vector<uint8_t> inlier;  // by observation
  int inliers = 0;
};

// Estimates the pose from points with many outliers: P3P in RANSAC with truncated cost (Torr &
// Zisserman 2000) and local refinement of each new best pose (Chum et al. 2003). `observations`
// must be sorted by reliability, best first: samples are drawn from a growing front part (Chum &
// Matas 2005).
AbsolutePoseReport EstimateAbsolutePose(const Camera& camera,
                                        std::span<const PointObservation> observations,
                                        const AbsolutePoseOptions& options, Rng& rng);

}  // namespace oaslam
