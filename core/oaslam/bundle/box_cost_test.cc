#include "oaslam/bundle/box_cost.h"

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

const Camera kCamera{.width = 640, .height = 480, .fx = 520, .fy = 510, .cx = 318, .cy = 242};

Rigid3 KeyframePose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized())),
          {0.3, -0.4, 1.2}};
}

Rigid3 CamFromKeyframe() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.2, 1, 0.5).normalized())),
          {0.05, -0.02, 0.1}};
}

Ellipsoid SomeEllipsoid() {
  Ellipsoid ellipsoid;
  ellipsoid.center =
      (CamFromKeyframe() * KeyframePose()).Inverse() * Eigen::Vector3d(0.2, -0.1, 2.5);
  ellipsoid.half_axes = {0.2, 0.3, 0.15};
  ellipsoid.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 1, 0).normalized());
  return ellipsoid;
}

BoxMeasurement Measured(unsigned char truncated = 0) {
  return {&kCamera, CamFromKeyframe(), {300, 150, 420, 280}, 0.8, truncated};
}

// Wide enough for changes near zero.
ceres::NumericDiffOptions Steps() {
  ceres::NumericDiffOptions steps;
  steps.ridders_relative_initial_step_size = 1e-4;
  return steps;
}

Eigen::Vector4d ResidualOf(const BoxEdgeCost& cost, const std::vector<const double*>& blocks) {
  Eigen::Vector4d residual;
  EXPECT_TRUE(cost.Evaluate(blocks.data(), residual.data(), nullptr));
  return residual;
}

TEST(BoxEdgeCost, DerivativesAgreeWithNumericOnes) {
  const PoseManifold manifold;
  const PoseBlock pose = ToBlock(KeyframePose());
  const ShapeBlock shape{0.02, -0.01, 0.03, 0.1, -0.05, 0.02, 0.2};
  for (const int truncated : {0, 0 + kLeft, kTop | kRight}) {
    for (const bool free_pose : {true, false}) {
      for (const bool free_shape : {true, false}) {
        if (!free_pose && !free_shape) continue;
        const BoxEdgeCost cost(Measured(static_cast<unsigned char>(truncated)), SomeEllipsoid(),
                               free_shape,
                               free_pose ? std::nullopt : std::optional(KeyframePose()));
        std::vector<const ceres::Manifold*> manifolds;
        std::vector<const double*> blocks;
        if (free_pose) {
          manifolds.push_back(&manifold);
          blocks.push_back(pose.data());
        }
        if (free_shape) {
          manifolds.push_back(nullptr);
          blocks.push_back(shape.data());
        }
        ceres::GradientChecker checker(&cost, &manifolds, Steps());
        ceres::GradientChecker::ProbeResults results;
        EXPECT_TRUE(checker.Probe(blocks.data(), 1e-6, &results)) << results.error_log;
      }
    }
  }
}

TEST(BoxEdgeCost, IsZeroForTheProjectionItself) {
  BoxMeasurement measured = Measured();
  measured.box = *ProjectToBox(SomeEllipsoid(), CamFromKeyframe() * KeyframePose(), kCamera);
  const PoseBlock pose = ToBlock(KeyframePose());
  const BoxEdgeCost cost(measured, SomeEllipsoid(), false, std::nullopt);
  EXPECT_LT(ResidualOf(cost, {pose.data()}).norm(), 1e-9);
  // A rotation of the camera by 10 px: one sigma an edge, weighted by the score.
  const PoseBlock turned = ToBlock(
      Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(10 / kCamera.fx, Eigen::Vector3d::UnitY())),
             Eigen::Vector3d::Zero()) *
      KeyframePose());
  const Eigen::Vector4d off = ResidualOf(cost, {turned.data()});
  EXPECT_NEAR(std::abs(off[0]), std::sqrt(0.8), 0.1);
  EXPECT_NEAR(std::abs(off[2]), std::sqrt(0.8), 0.1);
}

TEST(BoxEdgeCost, BehindTheCameraItIsLargeAndFlat) {
  Ellipsoid behind = SomeEllipsoid();
  behind.center = (CamFromKeyframe() * KeyframePose()).Inverse() * Eigen::Vector3d(0, 0, -2);
  const BoxEdgeCost cost(Measured(), behind, false, std::nullopt);
  const PoseBlock pose = ToBlock(KeyframePose());
  const double* blocks[] = {pose.data()};
  Eigen::Vector4d residual;
  Eigen::Matrix<double, 4, 7, Eigen::RowMajor> jacobian;
  double* jacobians[] = {jacobian.data()};
  ASSERT_TRUE(cost.Evaluate(blocks, residual.data(), jacobians));
  EXPECT_GT(residual.norm(), 20);
  EXPECT_EQ(jacobian.norm(), 0);
}

TEST(ShapePriorCost, DerivativesAgreeWithNumericOnesAndASphereCostsNothing) {
  const ShapeBlock shape{0.02, -0.01, 0.03, 0.1, -0.05, 0.02, 0.2};
  for (const bool upright : {true, false}) {
    const ShapePriorCost cost(SomeEllipsoid(), upright);
    const double* blocks[] = {shape.data()};
    const std::vector<const ceres::Manifold*> manifolds{nullptr};
    ceres::GradientChecker checker(&cost, &manifolds, Steps());
    ceres::GradientChecker::ProbeResults results;
    EXPECT_TRUE(checker.Probe(blocks, 1e-6, &results)) << results.error_log;
    Ellipsoid sphere = SomeEllipsoid();
    sphere.half_axes.setConstant(0.2);
    const ShapeBlock none{};
    const double* at_start[] = {none.data()};
    Eigen::Vector4d residual;
    ShapePriorCost(sphere, upright).Evaluate(at_start, residual.data(), nullptr);
    EXPECT_LT(residual.norm(), 1e-12);
  }
}

}  // namespace
}  // namespace oaslam
