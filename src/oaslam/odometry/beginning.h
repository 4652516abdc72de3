#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// The prototype's values; of other ones nothing was measured.
struct BeginningOptions {
  double least_parallax_px = 12;  // median, of the tracked image at 640 px; less hides the motion
  double late_s = 1;              // after that, a third of it must do
  // How much worse the next distinct motion must explain the images, in units of the mean squared
  // error of the best one.
  double least_gap = 40;
  double max_behind = 0.08;  // share of points at infinity or beyond it
  double max_unit = 6;       // mean squared error, in squared sigmas
};

// How the camera moved from the first image to the newest, but for the length of the way.
struct BeginningMotion {
  Eigen::Quaterniond first_from_newest;
  Eigen::Vector3d direction;  // of the newest camera in the frame of the first, length 1
};

struct Beginning {
  Window window;            // with the best motion; in it the median depth is 1
  bool is_decided = false;  // no other motion explains the images nearly as well
  // Nothing where there is too little parallax: then `window` is as given.
  std::optional<BeginningMotion> leader{};
};

// The motion of the first images: those of the essential matrix and of the homography, and fourteen
// directions with the rotation of the flow, each optimised over all images of the window. A plane
// has two motions that two images cannot tell apart; several images can. The first image must be
// the one that is held, all others must have the rotation of the flow.
Beginning BeginMotion(const Window& window, const WindowOptions& options,
                      const BeginningOptions& beginning, double image_width, Rng& rng);

// The motion near the one that led some images ago; one start instead of some twenty, and it
// decides nothing.
Beginning FollowLeader(const Window& window, const WindowOptions& options,
                       const BeginningMotion& leader);

}  // namespace oaslam
