#pragma once

#include <span>
#include <utility>

#include "oaslam/odometry/inverse_depth_solver.h"
#include "oaslam/odometry/window.h"

namespace oaslam {

// Evaluates other motions of the images after one image of a window, the pivot. All images up to
// the pivot are held. The images after the pivot are free, also those that the window holds: in a
// fast turn the free keyframes of the window span only half a second. The depths of points that
// depend on the motion in question are searched anew.
class MotionsSince {
 public:
  // `window` must outlive it.
  MotionsSince(const Window& window, const WindowImage& pivot, const WindowOptions& options);

  struct Start {
    InverseDepthState state;
    double cost = 0;  // CostOfImages
  };

  Start Present() const;
  // The motion in which some images, the newest among them, have the poses cam_from_odom of `poses`
  // (by id, ascending). Between these images, the camera centre and the correction of the rotation
  // are interpolated over time.
  Start WithPoses(std::span<const std::pair<int, Rigid3>> poses) const;

  void Improve(int iterations, InverseDepthSolver& solver, Start& start) const;
  // The window with this motion.
  Window Made(const Start& start) const;

 private:
  bool IsNew(size_t point) const;

  const Window& window_;
  int pivot_;     // index of the image
  int pivot_id_;  // its id
  WindowProblem made_;
  InverseDepthProblem bare_;   // by the images alone
  InverseDepthProblem loose_;  // with the priors of depths that were known at the pivot
};

}  // namespace oaslam
