#include "oaslam/odometry/patch_edge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>

#include "grey_scene.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

GreyBuffer PatchOf(const std::function<double(int, int)>& grey) {
  return synthetic::Drawn(40, 30, [&](int x, int y) { return std::lround(grey(x, y)); });
}

PatchEdge EdgeOf(const GreyBuffer& image) { return EdgeAt(image.view(), {20, 15}); }

TEST(PatchEdge, AStripeSlidesAlongItself) {
  // Stripes that lean by 20 degrees, with a little texture along them.
  const double lean = 20 * kDegree;
  const PatchEdge edge = EdgeOf(PatchOf([&](int x, int y) {
    return 128 + 60 * std::sin(0.6 * (x * std::cos(lean) + y * std::sin(lean))) +
           3 * std::sin(0.9 * y);
  }));
  EXPECT_GT(edge.slide, 3);
  const Eigen::Vector2d along(-std::sin(lean), std::cos(lean));
  EXPECT_GT(std::abs(edge.along.dot(along)), std::cos(3 * kDegree));
  // Sighted ten pixels further along the edge it is off by less than two across it.
  EXPECT_LT(edge.Off(10 * along), edge.Off(2 * Eigen::Vector2d(along.y(), -along.x())) * 2);
  EXPECT_TRUE((edge.RootOfInformation() * edge.Covariance() * edge.RootOfInformation())
                  .isApprox(Eigen::Matrix2d::Identity(), 1e-9));
}

TEST(PatchEdge, ACornerDoesNotSlide) {
  const PatchEdge corner =
      EdgeOf(PatchOf([](int x, int y) { return x < 20 && y < 15 ? 200 : 60; }));
  EXPECT_LT(corner.slide, 1.2);
  EXPECT_DOUBLE_EQ(EdgeOf(PatchOf([](int, int) { return 90; })).slide, 1);  // nothing to see
}

TEST(PatchEdge, APerfectEdgeAndTheBorderOfTheImageAreNoExceptions) {
  const GreyBuffer image = PatchOf([](int x, int) { return x < 20 ? 200 : 60; });
  const PatchEdge edge = EdgeOf(image);
  EXPECT_TRUE(std::isfinite(edge.slide));
  EXPECT_GT(edge.slide, 5);
  EXPECT_NEAR(std::abs(edge.along.y()), 1, 1e-9);
  for (const Eigen::Vector2f& px : {Eigen::Vector2f(0, 0), Eigen::Vector2f(39, 29)})
    EXPECT_DOUBLE_EQ(EdgeAt(image.view(), px).slide, 1);
}

TEST(PatchEdge, TurnsWithTheCamera) {
  const PatchEdge upright{Eigen::Vector2d::UnitY(), 4};
  const PatchEdge turned =
      upright.In(Rigid3(RotationOf({0, 0, 90 * kDegree}), Eigen::Vector3d(1, 2, 3)));
  EXPECT_NEAR(std::abs(turned.along.x()), 1, 1e-9);
  EXPECT_DOUBLE_EQ(turned.slide, 4);
}

}  // namespace
}  // namespace oaslam
