#include "oaslam/estimation/triangulation.h"

#include <gtest/gtest.h>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

TEST(Triangulation, RecoversPointsInTheWorld) {
  Rng rng(1);
  for (int i = 0; i < 100; ++i) {
    const Rigid3 first(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())),
                       {0.2, 0.1, 1});
    const Rigid3 second(Eigen::Quaterniond(Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitX())),
                        {-0.4, 0.1, 1.2});
    const Eigen::Vector3d x(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(2, 6));
    const auto found = TriangulateRays(first, second, first * x, second * x);
    ASSERT_TRUE(found);
    EXPECT_LT((found->point - x).norm(), 1e-9);
    const Eigen::Vector3d a = x - first.OriginInSource(), b = x - second.OriginInSource();
    EXPECT_NEAR(found->cos_parallax, a.normalized().dot(b.normalized()), 1e-9);
  }
}

TEST(Triangulation, RefusesPointsBehindAndParallelRays) {
  const Rigid3 second(Eigen::Quaterniond::Identity(), {-1, 0, 0});
  const Eigen::Vector3d behind(0.3, 0.2, -4);
  EXPECT_FALSE(TriangulateRays(second, -behind, -(second * behind)));
  EXPECT_FALSE(TriangulateRays(second, {0, 0, 1}, {0, 0, 1}));
}

TEST(Triangulation, ReprojectionOfNoisyRaysStaysWithinTheNoise) {
  Rng rng(2);
  const Rigid3 second(Eigen::Quaterniond::Identity(), {-0.1, 0, 0});
  int count = 0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d x(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(2, 4)),
        y = second * x;
    const Eigen::Vector2d a =
        x.hnormalized() + Eigen::Vector2d(rng.Gaussian(0.002), rng.Gaussian(0.002));
    const Eigen::Vector2d b =
        y.hnormalized() + Eigen::Vector2d(rng.Gaussian(0.002), rng.Gaussian(0.002));
    const auto found = TriangulateRays(second, a.homogeneous(), b.homogeneous());
    if (!found) continue;  // the noise made the rays diverge
    ++count;
    EXPECT_LT((found->point.hnormalized() - a).norm(), 0.008);
    EXPECT_LT(((second * found->point).hnormalized() - b).norm(), 0.008);
  }
  EXPECT_GT(count, 190);
}

}  // namespace
}  // namespace oaslam
