#pragma once

#include <span>
#include <utility>

#include "oaslam/odometry/inverse_depth_solver.h"
#include "oaslam/odometry/window.h"

namespace oaslam {

// Other motions of the images after one of a window, and how well the images agree with them. All
// images up to that one, the pivot, are held; those after it are free, also where the window holds
// some, as in a fast turn, in which its free keyframes span half a second. Depths of points that
// rest on the motion in question are searched anew.
class MotionsSince {
 public:
  // `window` must outlive it.
  MotionsSince(const Window& window, const WindowImage& pivot, const WindowOptions& options);

  struct Start {
    InverseDepthState state;
    double cost = 0;  // CostOfImages
  };

  Start Present() const;
  // Some images, the newest among them, have these poses cam_from_odom (by id, ascending). Between
  // them the camera moves straight, and its rotations change as theirs do.
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
  InverseDepthProblem loose_;  // with what was known of depths at the pivot
};

}  // namespace oaslam
