#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "oaslam/bundle/schur_solver.h"
#include "oaslam/camera.h"
#include "oaslam/geometry/camera_derivatives.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// Shared by all images: the intrinsics (IntrinsicsStep), and the seconds in which the camera reads
// out an image.
inline constexpr int kShared = kIntrinsics + 1;
using SharedStep = Eigen::Matrix<double, kShared, 1>;

// A point seen by a camera that may move while it reads out the image.
struct RolledSight : PointSight {
  Eigen::Vector2d by_readout =
      Eigen::Vector2d::Zero();  // pixels the point is off for each second of the readout
};

// Poses and points seen by one camera whose intrinsics are shared and not known well.
struct IntrinsicsState {
  Camera camera;
  double readout_s = 0;
  std::vector<Rigid3> poses;  // cam_from_world; the first stays
  std::vector<Eigen::Vector3d> points;
};

// What is known of the intrinsics beforehand.
struct IntrinsicsPrior {
  Camera camera;
  double readout_s = 0;
  // Per shared parameter, in its unit; infinite: nothing, 0: held at its value.
  SharedStep sigma = SharedStep::Zero();
};

// Minimises the reprojection errors of `sights` in the original (distorted) image, sorted by point,
// over the intrinsics, all poses but the first, and all points: Levenberg-Marquardt on the Schur
// complement of the points, as MinimizeReprojection. PointSight::px is a pixel of the original
// image.
SchurReport MinimizeWithIntrinsics(std::span<const RolledSight> sights,
                                   const IntrinsicsPrior& prior, const SchurOptions& options,
                                   IntrinsicsState& state);

// The information (inverse covariance) that sights of unit variance and the prior hold on the
// intrinsics, poses and points being unknown: the Schur complement of all others.
Eigen::Matrix<double, kShared, kShared> InformationOnIntrinsics(std::span<const RolledSight> sights,
                                                                const IntrinsicsPrior& prior,
                                                                const IntrinsicsState& state);

}  // namespace oaslam
