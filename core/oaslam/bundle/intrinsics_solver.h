#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "oaslam/bundle/schur_solver.h"
#include "oaslam/camera.h"
#include "oaslam/geometry/camera_derivatives.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// The parameters that all images share: the intrinsics (IntrinsicsStep), and the time in seconds in
// which the camera reads out an image.
inline constexpr int kShared = kIntrinsics + 1;
using SharedStep = Eigen::Matrix<double, kShared, 1>;

// A point seen by a camera that may move while it reads out the image.
struct RollingMeasurement : PointMeasurement {
  // Displacement of the point in pixels for each second of readout time.
  Eigen::Vector2d by_readout = Eigen::Vector2d::Zero();
};

// Poses and points seen by one camera with uncertain intrinsics.
struct IntrinsicsState {
  Camera camera;
  double readout_s = 0;
  std::vector<Rigid3> poses;  // cam_from_world; the first is fixed
  std::vector<Eigen::Vector3d> points;
};

struct IntrinsicsPrior {
  Camera camera;
  double readout_s = 0;
  // Standard deviation of each shared parameter, in its unit; infinite: unknown, 0: fixed.
  SharedStep sigma = SharedStep::Zero();
};

// Minimises the reprojection errors of `measurements`, sorted by point, in the original (distorted)
// image, over the intrinsics, all poses but the first, and all points: Levenberg-Marquardt on the
// Schur complement of the points, like MinimizeReprojection. PointMeasurement::px is a pixel of the
// original image.
MinimizationReport MinimizeWithIntrinsics(std::span<const RollingMeasurement> measurements,
                                          const IntrinsicsPrior& prior, const SchurOptions& options,
                                          IntrinsicsState& state);

// The information matrix (inverse covariance) of the shared parameters, given measurements of unit
// variance and the prior, with unknown poses and points, which a Schur complement eliminates.
Eigen::Matrix<double, kShared, kShared> InformationOnIntrinsics(
    std::span<const RollingMeasurement> measurements, const IntrinsicsPrior& prior,
    const IntrinsicsState& state);

}  // namespace oaslam
