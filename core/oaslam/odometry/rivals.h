#pragma once

#include <optional>

#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Another motion of the newest images that explains them better than the window's.
struct Rival {
  Window window;
  int since = 0;  // id of the newest image whose pose is as it was
};

// Beside a plane two motions explain two images alike, and in a narrow view a way looks like a
// turn. A window is optimised from its last minimum, and does not leave one that is wrong, although
// two images know how the camera turned (Lee and Civera 2021). So the newest images are looked
// through in segments of `span_s`: the motions of the essential matrix and of the homography
// between the ends of a segment, and the turn that explains the flow alone, are optimised over a
// few images and points without what the window believes of its new points. Where one is clearly
// better than the present motion, so are the segments before; the motions of those that are better
// are chained, and the whole is compared with the window by the images alone. Nothing where the
// window's motion is the best, or images share too little.
std::optional<Rival> BetterMotion(const Window& window, double span_s, const WindowOptions& options,
                                  InverseDepthSolver& solver, Rng& rng);

// When to look for a rival: the images fit worse than those of the last seconds.
class RivalWatch {
 public:
  // `cost`: WindowFit::cost at this time. Returns the span_s to look through the images by; nothing
  // while they fit as usual, or were looked through just now.
  std::optional<double> SpanToLookAt(double time_s, double cost);

 private:
  double usual_cost_ = 0;  // the median of the last seconds
  double time_s_ = 0, looked_s_ = 0;
  bool looks_at_long_ = false;
};

}  // namespace oaslam
