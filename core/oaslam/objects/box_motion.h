#pragma once

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// How the camera has moved between two images, and the least depth of what it saw.
struct MotionSinceBox {
  Rigid3 now_from_then;
  double min_depth = 0;  // in the earlier camera, in units of the map; 0: no bound
};

// Predicts where the later image shows the box of an earlier one, if its object stands still at a
// depth of `1 / inverse_depth` in the earlier camera: the centre moves along the epipolar line, and
// the size changes with the distance. Ideal image; an empty box behind the camera.
Box BoxAfterMotion(const Box& earlier, const Rigid3& now_from_then, double inverse_depth,
                   const Camera& camera);

// The overlap (IoU) of a detected box with an earlier box, moved as if its object stood still. The
// depth of the object is unknown: the function takes the depth, not below `motion.min_depth`, at
// which the lines of sight through the two centres come closest. Without the motion small objects
// would not overlap, since they move by more than their own size between two images. `truncated`:
// edges of the detected box at the image border (EdgeBit).
double OverlapAfterMotion(const Box& earlier, const Box& detected, unsigned char truncated,
                          const MotionSinceBox& motion, const Camera& camera);

}  // namespace oaslam
