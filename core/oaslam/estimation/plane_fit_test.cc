#include "oaslam/estimation/plane_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oaslam {
namespace {

using testing::ElementsAreArray;

constexpr double kTolerance = 0.01;
const Eigen::Vector3d kViewpoint(0, 0, 0);

std::vector<Eigen::Vector3d> OnTilted(int count, double noise, Rng& rng) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double x = rng.Uniform(-1, 1), y = rng.Uniform(-1, 1);
    points.emplace_back(x, y, 4 + 0.5 * x + rng.Gaussian(noise));
  }
  return points;
}

TEST(PlaneFit, FindsThePlaneAmongOthers) {
  Rng rng(1);
  std::vector<Eigen::Vector3d> points = OnTilted(40, 0.005, rng);
  for (int i = 0; i < 30; ++i)
    points.emplace_back(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(2, 8));
  const auto fit = FitPlane(points, kViewpoint, kTolerance, rng);
  ASSERT_TRUE(fit);
  const Eigen::Vector3d truth = Eigen::Vector3d(0.5, 0, -1).normalized();  // towards the viewpoint
  EXPECT_GT(fit->plane.normal().dot(truth), 0.999);
  EXPECT_NEAR(fit->plane.signedDistance({0, 0, 4}), 0, 0.02);
  EXPECT_GE(fit->inliers.size(), 40u);
}

TEST(PlaneFit, IsTheSameForTheSameSeed) {
  Rng noise(3);
  const std::vector<Eigen::Vector3d> points = OnTilted(30, 0.02, noise);
  Rng a(5), b(5);
  const auto first = FitPlane(points, kViewpoint, kTolerance, a),
             second = FitPlane(points, kViewpoint, kTolerance, b);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->plane.coeffs(), second->plane.coeffs());
  EXPECT_THAT(first->inliers, ElementsAreArray(second->inliers));
}

TEST(PlaneFit, RefusesWhatSpansNoPlane) {
  Rng rng(1);
  const std::vector<Eigen::Vector3d> two{{0, 0, 3}, {1, 0, 3}};
  EXPECT_FALSE(FitPlane(two, kViewpoint, kTolerance, rng));
  const std::vector<Eigen::Vector3d> same(10, Eigen::Vector3d(0, 0, 3));
  EXPECT_FALSE(FitPlane(same, kViewpoint, kTolerance, rng));
  std::vector<Eigen::Vector3d> line, grazing;
  for (int i = 0; i < 10; ++i) line.emplace_back(0.1 * i, 0, 3);
  EXPECT_FALSE(FitPlane(line, kViewpoint, kTolerance, rng));
  for (int i = 0; i < 30; ++i) grazing.emplace_back(rng.Uniform(-1, 1), 0.05, rng.Uniform(2, 6));
  EXPECT_FALSE(FitPlane(grazing, kViewpoint, 1e-4, rng));
}

}  // namespace
}  // namespace oaslam
