#pragma once

#include <vector>

#include "oaslam/estimation/two_view_models.h"
#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// The points of a window that two of its images see; `first` and `second` are ids of images.
RayMatches MatchesBetween(const Window& window, int first, int second,
                          const WindowOptions& options);

// The motions second_from_first that two images alone determine, translations of length 1: those of
// the essential matrix and of the homography, by RANSAC with the given numbers of samples.
std::vector<Rigid3> MotionsBetween(const RayMatches& matches, int of_essential, int of_homography,
                                   Rng& rng);

}  // namespace oaslam
