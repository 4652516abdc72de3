#pragma once

#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct BeginningOptions {
  double least_parallax_px = 12;  // median, of the tracked image at 640 px; less hides the motion
  double late_s = 1;              // after this time a third of the parallax suffices
  // How much worse the next distinct motion must explain the images, in units of the mean squared
  // error of the best one.
  double least_gap = 40;
  double max_behind = 0.08;    // share of points with an inverse depth of 0 or less
  double max_outliers = 0.25;  // share of sightings; with more, no motion explains the images
};

// The least number of points that the first and the newest image must share: fewer do not determine
// the motion.
inline constexpr int kLeastMatches = 30;
inline constexpr size_t kLeastImages = 4;  // of a beginning: fewer do not distinguish two motions

struct Beginning {
  Window window;            // with the best motion, if there is one
  bool is_known = false;    // false where there is too little parallax: then `window` is as given
  bool is_decided = false;  // no other motion explains the images nearly as well
};

// How many points the first and the newest image both see.
int MatchesOfFirst(const Window& window);

// Estimates the motion of the first images. The hypotheses are the motions of the essential matrix
// and of the homography, and fourteen directions of translation with the rotation of the flow; each
// is optimised over all images of the window. A plane allows two motions that two images cannot
// distinguish; several images can. Only the first image may be held, and the poses of all others
// must have the rotations estimated from the optical flow. The unit of length is that of `before`,
// the last window of the same beginning, and moves slowly from call to call towards the median
// depth; without `before` it is the median depth.
Beginning BeginMotion(const Window& window, const Window* before, const WindowOptions& options,
                      const BeginningOptions& beginning, double image_width, Rng& rng);

// Optimises a single hypothesis, the motion of `before`, instead of some twenty; `is_decided` stays
// false.
Beginning FollowLeader(const Window& window, const Window& before, const WindowOptions& options);

}  // namespace oaslam
