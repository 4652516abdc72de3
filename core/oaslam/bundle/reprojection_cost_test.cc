#include "oaslam/bundle/reprojection_cost.h"

#include <ceres/gradient_checker.h>
#include <ceres/manifold_test_utils.h>
#include <gtest/gtest.h>

namespace oaslam {
namespace {

const Camera kPinhole{.width = 640, .height = 480, .fx = 520, .fy = 510, .cx = 318, .cy = 242};

Rigid3 SomePose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized())),
          {0.3, -0.4, 1.2}};
}

Eigen::Vector3d SomePoint() { return SomePose().Inverse() * Eigen::Vector3d(0.4, -0.3, 2.5); }

TEST(PoseManifold, ObeysTheLawsOfManifolds) {
  using namespace ceres;  // for the matchers behind the macro
  const PoseManifold manifold;
  const PoseBlock block = ToBlock(SomePose());
  const ceres::Vector x = Eigen::Map<const Eigen::Matrix<double, 7, 1>>(block.data());
  for (int i = 0; i < 10; ++i) {
    const ceres::Vector delta = ceres::Vector::Random(6);
    ceres::Vector y(7);
    manifold.Plus(x.data(), ceres::Vector(0.3 * ceres::Vector::Random(6)).data(), y.data());
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-8);
  }
}

TEST(ReprojectionCost, DerivativesAgreeWithNumericOnes) {
  const ReprojectionCost cost(kPinhole, {300, 200}, 1.44);
  const PoseManifold manifold;
  const std::vector<const ceres::Manifold*> manifolds{&manifold, nullptr};
  ceres::GradientChecker checker(&cost, &manifolds, ceres::NumericDiffOptions());
  const PoseBlock pose = ToBlock(SomePose());
  const Eigen::Vector3d point = SomePoint();
  const double* parameters[] = {pose.data(), point.data()};
  ceres::GradientChecker::ProbeResults results;
  EXPECT_TRUE(checker.Probe(parameters, 1e-6, &results)) << results.error_log;
}

TEST(DepthCost, DerivativesAgreeWithNumericOnes) {
  const PoseManifold manifold;
  const PoseBlock pose = ToBlock(SomePose());
  const Eigen::Vector3d point = SomePoint();
  const DepthCost free({2.3, 0.01}, std::nullopt), fixed({2.3, 0.01}, SomePose());
  const std::vector<const ceres::Manifold*> of_free{&manifold, nullptr}, of_fixed{nullptr};
  const double *both[] = {pose.data(), point.data()}, *only_point[] = {point.data()};
  ceres::GradientChecker::ProbeResults results;
  // A turn about the optical axis changes no depth: the relative error of 0 says nothing.
  const auto expect_true = [&](const DepthCost& cost, const auto& manifolds, const auto& values) {
    ceres::GradientChecker(&cost, &manifolds, ceres::NumericDiffOptions())
        .Probe(values, 1e-6, &results);
    EXPECT_NEAR(results.residuals[0], 20, 1e-9);  // 2.5 m instead of 2.3
    for (size_t block = 0; block < manifolds.size(); ++block)
      EXPECT_LT((results.local_jacobians[block] - results.local_numeric_jacobians[block]).norm(),
                1e-6);
  };
  expect_true(free, of_free, both);
  expect_true(fixed, of_fixed, only_point);
}

TEST(ReprojectionCost, TheFixedPoseVariantIsTheSame) {
  const ReprojectionCost free(kPinhole, {300, 200}, 1.44);
  const FixedPoseReprojectionCost fixed(kPinhole, SomePose(), {300, 200}, 1.44);
  const PoseBlock pose = ToBlock(SomePose());
  const Eigen::Vector3d point = SomePoint();
  const double* both[] = {pose.data(), point.data()};
  const double* only_point[] = {point.data()};
  Eigen::Vector2d r_free, r_fixed;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> j_free, j_fixed;
  double* of_free[] = {nullptr, j_free.data()};
  double* of_fixed[] = {j_fixed.data()};
  ASSERT_TRUE(free.Evaluate(both, r_free.data(), of_free));
  ASSERT_TRUE(fixed.Evaluate(only_point, r_fixed.data(), of_fixed));
  EXPECT_LT((r_free - r_fixed).norm(), 1e-9);
  EXPECT_LT((j_free - j_fixed).norm(), 1e-9);
}

TEST(ReprojectionCost, BehindTheCameraIsExpensive) {
  const ReprojectionCost cost(kPinhole, {300, 200}, 1);
  const PoseBlock pose = ToBlock(SomePose());
  const Eigen::Vector3d point = SomePose().Inverse() * Eigen::Vector3d(0, 0, -2);
  const double* parameters[] = {pose.data(), point.data()};
  Eigen::Vector2d r;
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), nullptr));
  EXPECT_GT(r.norm(), 50);
}

}  // namespace
}  // namespace oaslam
