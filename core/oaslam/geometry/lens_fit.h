#pragma once

#include <Eigen/Core>
#include <functional>

#include "oaslam/camera.h"

namespace oaslam {

// A lens in any model: the image of a direction (of any length), in focal lengths from the
// principal point; not finite where it has none.
using LensFunction = std::function<Eigen::Vector2d(const Eigen::Vector3d& direction)>;

struct LensFit {
  Camera camera;
  double max_error_px = 0;  // over the image; infinite where no camera was found
};

// The camera of one of our lens models that is closest to `lens`, up to 88 degrees from the axis.
// `frame`: the image size and name of the result, and the focal lengths and principal point that
// convert values of `lens` to pixels; the result has focal lengths and a principal point of its
// own.
LensFit FitLens(const LensFunction& lens, const Camera& frame);

}  // namespace oaslam
