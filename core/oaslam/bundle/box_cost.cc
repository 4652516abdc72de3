#include "oaslam/bundle/box_cost.h"

#include <cmath>

#include "oaslam/estimation/ellipsoid_residuals.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

// The error of each edge of an object that is not in front of the camera, in units of kHuberPx: 150
// detector pixels, as of a very wrong box, so that no step gains by going there.
constexpr double kBoxBehindError = 15;

using Matrix47 = Eigen::Matrix<double, 4, 7, Eigen::RowMajor>;

// The Jacobian that converts a motion of a keyframe into that of a camera whose
// pose is relative to it.
Eigen::Matrix<double, 6, 6> CarriedMotion(const Rigid3& cam_from_keyframe) {
  const Eigen::Matrix3d rotation = cam_from_keyframe.rotation.toRotationMatrix();
  Eigen::Matrix<double, 6, 6> motion;
  motion << rotation, Skew(cam_from_keyframe.translation) * rotation, Eigen::Matrix3d::Zero(),
      rotation;
  return motion;
}

}  // namespace

Ellipsoid WithShapeChange(const Ellipsoid& start, const double* change) {
  ShapeVector all = ShapeVector::Zero();
  all.head<7>() = Eigen::Map<const Eigen::Matrix<double, 7, 1>>(change);
  return Moved(start, all);
}

BoxEdgeCost::BoxEdgeCost(const BoxMeasurement& measured, const Ellipsoid& ellipsoid,
                         bool free_shape, const std::optional<Rigid3>& fixed_pose)
    : measured_(measured),
      ellipsoid_(ellipsoid),
      free_shape_(free_shape),
      fixed_pose_(fixed_pose),
      weight_(std::sqrt(measured.score) / (kHuberPx * DetectorPixel(*measured.camera))) {
  set_num_residuals(4);
  if (!fixed_pose_) mutable_parameter_block_sizes()->push_back(7);
  if (free_shape_) mutable_parameter_block_sizes()->push_back(7);
}

bool BoxEdgeCost::Evaluate(const double* const* parameters, double* residuals,
                           double** jacobians) const {
  const size_t shape_index = fixed_pose_ ? 0 : 1;
  const Rigid3 keyframe_from_world = fixed_pose_ ? *fixed_pose_ : FromBlock(parameters[0]);
  const Ellipsoid ellipsoid =
      free_shape_ ? WithShapeChange(ellipsoid_, parameters[shape_index]) : ellipsoid_;
  const auto view = ViewEllipsoid(ellipsoid, measured_.cam_from_keyframe * keyframe_from_world);
  Eigen::Map<Eigen::Vector4d> residual(residuals);
  // The weights of the rows; 0 for those without derivative.
  Eigen::Vector4d used = Eigen::Vector4d::Zero();
  if (view) {
    residual = weight_ * EdgeResidual(OutlineBox(view->outline, *measured_.camera), measured_.box,
                                      measured_.truncated);
    for (int row = 0; row < 4; ++row)
      if (!(measured_.truncated & (1 << row)) || residual[row] != 0) used[row] = weight_;
  } else {
    residual.setConstant(kBoxBehindError);
  }
  if (!jacobians) return true;
  if (!fixed_pose_ && jacobians[0]) {
    Eigen::Map<Matrix47> j(jacobians[0]);
    j.setZero();
    if (view) {
      Eigen::Matrix<double, 6, 7, Eigen::RowMajor> tangent_by_block;
      PoseManifold().MinusJacobian(parameters[0], tangent_by_block.data());
      j = used.asDiagonal() * DifferentiateByPose(*view, *measured_.camera) *
          CarriedMotion(measured_.cam_from_keyframe) * tangent_by_block;
    }
  }
  if (free_shape_ && jacobians[shape_index]) {
    Eigen::Map<Matrix47> j(jacobians[shape_index]);
    j.setZero();
    if (view) j = used.asDiagonal() * DifferentiateByShape(*view, *measured_.camera).leftCols<7>();
  }
  return true;
}

ShapePriorCost::ShapePriorCost(const Ellipsoid& ellipsoid, bool upright)
    : log_axes_(ellipsoid.half_axes.array().log()),
      rows_(ShapePriorRows(kPriorWeightPx / kHuberPx, upright)) {}

bool ShapePriorCost::Evaluate(const double* const* parameters, double* residuals,
                              double** jacobians) const {
  const Eigen::Vector3d log_axes = log_axes_ + Eigen::Map<const Eigen::Vector3d>(parameters[0] + 3);
  Eigen::Map<Eigen::Vector4d>{residuals} = rows_ * log_axes;
  if (!jacobians || !jacobians[0]) return true;
  Eigen::Map<Matrix47> j(jacobians[0]);
  j.setZero();
  j.middleCols<3>(3) = rows_;
  return true;
}

}  // namespace oaslam
