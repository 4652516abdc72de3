#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/rigid3.h"

namespace oaslam {

struct FocalReport {
  bool success = false;  // at least 8 inliers that determine pose and focal length
  Camera camera;         // with the focal length that was found
  Rigid3 cam_from_world;
  std::vector<uint8_t> inlier;  // by observation
  int inliers = 0;
  double chi2 = 0;  // sum over the inliers
  // 1 sigma of log(focal length), at the stated variances.
  double relative_sigma = std::numeric_limits<double>::infinity();
  // Covariance of the pose as in PoseReport, with unknown focal length.
  PoseCovariance covariance = PoseCovariance::Zero();
};

// Refines the pose and focal length of a camera without distortion from points, like RefinePose
// with one more unknown; the ratio of fx to fy stays. The start must be within some 15 % of the
// true focal length.
FocalReport RefinePoseAndFocal(const Camera& camera, const Rigid3& initial_cam_from_world,
                               std::span<const PointObservation> observations);

}  // namespace oaslam
