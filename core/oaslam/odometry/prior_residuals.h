#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "oaslam/odometry/inverse_depth_problem.h"

namespace oaslam {

// The residuals of a window's priors, in units of their sigmas.

// A pose cam_from_odom.
struct CamMatrices {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation, center;
};
std::vector<CamMatrices> CamsOf(const InverseDepthState& state);
// The poses of a triple.
std::array<Rigid3, 3> PosesOf(const InertialTriple& triple, const InverseDepthState& state);

// The rotation second_from_first as a vector: its axis times its angle, rad.
Eigen::Vector3d TurnVector(const CamMatrices& first, const CamMatrices& second);

Eigen::Vector3d ChangeOfVelocity(const VelocityPrior& v, const std::vector<CamMatrices>& cams);
// About the axes of the second image.
Eigen::Vector3d RotationError(const RotationPrior& r, const std::vector<CamMatrices>& cams);
Eigen::Vector3d ChangeOfTurnRate(const TurnRatePrior& t, const std::vector<CamMatrices>& cams);

}  // namespace oaslam
