#pragma once

#include <optional>

#include "oaslam/odometry/inverse_depth_solver.h"
#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Another motion of the newest images that explains them better than the window's.
struct Rival {
  Window window;
  int since = 0;  // id of the newest image whose pose is as it was
};

// Searches another motion of the newest images. In front of a plane two motions explain two images
// equally well, and in a narrow view a translation looks like a rotation. The optimisation of a
// window starts from its last minimum and does not leave a wrong one, although two images determine
// the rotation of the camera (Lee and Civera 2021). So the newest images are searched in segments
// of `span_s`: the motions of the essential matrix and of the homography between the ends of a
// segment, and the rotation that explains the flow alone, are optimised over a few images and
// points, without the window's priors of its new points. Where one of these motions is clearly
// better than the present one, the segment before is searched, too. The better motions are chained,
// and the chain is compared with the window by the images alone. Nothing where the window's motion
// is the best, or where images share too few points.
std::optional<Rival> BetterMotion(const Window& window, double span_s, const WindowOptions& options,
                                  InverseDepthSolver& solver, Rng& rng);

// Decides when to search for a rival: when the images fit worse than those of the last seconds.
class RivalWatch {
 public:
  // `cost`: WindowFit::cost at this time. Returns the `span_s` for BetterMotion; nothing while the
  // images fit as usual, or were searched just before.
  std::optional<double> SpanToLookAt(double time_s, double cost);

 private:
  double usual_cost_ = 0;  // the median of the last seconds
  double time_s_ = 0, looked_s_ = 0;
  bool looks_at_long_ = false;
};

}  // namespace oaslam
