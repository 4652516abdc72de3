#pragma once

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>
#include <optional>

#include "oaslam/bundle/reprojection_cost.h"
#include "oaslam/geometry/ellipsoid_jacobian.h"
#include "oaslam/types.h"

namespace oaslam {

// A change of an ellipsoid as a Ceres parameter block, initially zero: centre (world), log half
// axes, rotation about its third axis [rad].
using ShapeBlock = std::array<double, 7>;
Ellipsoid WithShapeChange(const Ellipsoid& start, const double* change);

// A detection, from a camera whose pose is relative to a keyframe.
struct BoxMeasurement {
  const Camera* camera = nullptr;
  Rigid3 cam_from_keyframe;
  Box box;  // ideal image
  double score = 1;
  unsigned char truncated = 0;  // EdgeBits
};

// The four edges of the projected ellipsoid minus those of the box, one-sided where truncated, in
// units of the 10 detector pixels at which Huber's kernel begins (kHuberPx), with analytic
// derivatives. Parameter blocks, in this order: the keyframe's pose, unless `fixed_pose` is given;
// the shape, if `free_shape` is true.
class BoxEdgeCost final : public ceres::CostFunction {
 public:
  BoxEdgeCost(const BoxMeasurement& measured, const Ellipsoid& ellipsoid, bool free_shape,
              const std::optional<Rigid3>& fixed_pose);
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  BoxMeasurement measured_;
  Ellipsoid ellipsoid_;
  bool free_shape_;
  std::optional<Rigid3> fixed_pose_;
  double weight_;
};

// A weak prior that keeps the length of an axis that no view determines near those of the others.
class ShapePriorCost final : public ceres::SizedCostFunction<4, 7> {
 public:
  ShapePriorCost(const Ellipsoid& ellipsoid, bool upright);
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Vector3d log_axes_;
  Eigen::Matrix<double, 4, 3> rows_;
};

}  // namespace oaslam
