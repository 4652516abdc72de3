#pragma once

#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>
#include <optional>

#include "oaslam/camera.h"
#include "oaslam/features/depth_map.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// A pose as a Ceres parameter block: quaternion x y z w, then translation, of cam_from_world.
using PoseBlock = std::array<double, 7>;
PoseBlock ToBlock(const Rigid3& pose);
Rigid3 FromBlock(const double* block);
inline Rigid3 FromBlock(const PoseBlock& block) { return FromBlock(block.data()); }

// The tangent space is a small motion (translation, rotation vector) applied after the pose: about
// the camera, where rotation and translation are hardly correlated.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// (projection - observation) / sigma in the ideal image, with analytic derivatives. While the cost
// is inactive its residual is zero, which is cheaper than removing the residual from the problem.
class ReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const Camera& camera, const Eigen::Vector2d& px, double sigma_px);
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;
  void set_active(bool active) { active_ = active; }

 private:
  double fx_, fy_;                   // divided by sigma
  Eigen::Vector2d px_minus_center_;  // divided by sigma
  bool active_ = true;
};

// (z - measured z) / sigma of a point in a camera. A pose that is given is fixed, and has no
// parameter block.
class DepthCost final : public ceres::CostFunction {
 public:
  DepthCost(const MeasuredDepth& depth, const std::optional<Rigid3>& cam_from_world);
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;
  void set_active(bool active) { active_ = active; }

 private:
  double z_, inverse_sigma_;
  bool active_ = true;
  std::optional<Rigid3> fixed_;
};

class FixedPoseReprojectionCost final : public ceres::SizedCostFunction<2, 3> {
 public:
  FixedPoseReprojectionCost(const Camera& camera, const Rigid3& cam_from_world,
                            const Eigen::Vector2d& px, double sigma_px);
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;
  void set_active(bool active) { active_ = active; }

 private:
  double fx_, fy_;
  Eigen::Vector2d px_minus_center_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  bool active_ = true;
};

}  // namespace oaslam
