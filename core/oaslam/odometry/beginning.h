#pragma once

#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct BeginningOptions {
  double least_parallax_px = 12;  // median, of the tracked image at 640 px; less hides the motion
  double late_s = 1;              // after that, a third of it must do
  // How much worse the next distinct motion must explain the images, in units of the mean squared
  // error of the best one.
  double least_gap = 40;
  double max_behind = 0.08;    // share of points at infinity or beyond it
  double max_outliers = 0.25;  // share of sightings: more, and no motion explains the images
};

// A first image that shares fewer points with the newest says nothing of its motion.
inline constexpr int kLeastMatches = 30;
inline constexpr size_t kLeastImages = 4;  // of a beginning: fewer do not tell two motions apart

struct Beginning {
  Window window;            // with the best motion, if there is one
  bool is_known = false;    // false where there is too little parallax: then `window` is as given
  bool is_decided = false;  // no other motion explains the images nearly as well
};

// How many points the first and the newest image both see.
int MatchesOfFirst(const Window& window);

// The motion of the first images: those of the essential matrix and of the homography, and fourteen
// directions with the rotation of the flow, each optimised over all images of the window. A plane
// has two motions that two images cannot tell apart; several images can. The first image must be
// the one that is held, all others must have the rotation of the flow. The unit of length is that
// of `before`, the last window of the same beginning, drawn slowly to the median depth; the median
// depth where there is none.
Beginning BeginMotion(const Window& window, const Window* before, const WindowOptions& options,
                      const BeginningOptions& beginning, double image_width, Rng& rng);

// The motion near the one of the window before; one start instead of some twenty, and it decides
// nothing.
Beginning FollowLeader(const Window& window, const Window& before, const WindowOptions& options);

}  // namespace oaslam
