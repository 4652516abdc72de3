#include "oaslam/geometry/p3p.h"

#include <gtest/gtest.h>

#include <cmath>

#include "oaslam/geometry/polynomial.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

struct Problem {
  Rigid3 cam_from_world;
  std::array<Eigen::Vector3d, 3> rays, points;
};

Eigen::Vector3d RandomVector(Rng& rng, double size) {
  return {rng.Uniform(-size, size), rng.Uniform(-size, size), rng.Uniform(-size, size)};
}

Problem RandomProblem(Rng& rng) {
  Problem p;
  p.cam_from_world.rotation =
      Eigen::Quaterniond(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1))
          .normalized();
  p.cam_from_world.translation = RandomVector(rng, 5);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d in_cam(rng.Uniform(-2, 2), rng.Uniform(-2, 2), rng.Uniform(1, 8));
    p.rays[i] = in_cam.normalized();
    p.points[i] = p.cam_from_world.Inverse() * in_cam;
  }
  return p;
}

double RayError(const Rigid3& pose, const Problem& p) {
  double worst = 0;
  for (int i = 0; i < 3; ++i)
    worst = std::max(worst, ((pose * p.points[i]).normalized() - p.rays[i]).norm());
  return worst;
}

TEST(P3P, FindsTheTruePoseAmongExactSolutions) {
  Rng rng(1);
  int missed = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Problem p = RandomProblem(rng);
    const P3PPoses solved = SolveP3P(p.rays, p.points);
    bool found = false;
    for (int i = 0; i < solved.count; ++i) {
      EXPECT_LT(RayError(solved.poses[i], p), 1e-7);
      found |= (solved.poses[i].translation - p.cam_from_world.translation).norm() < 1e-4 &&
               solved.poses[i].rotation.angularDistance(p.cam_from_world.rotation) < 1e-4;
    }
    missed += !found;
  }
  // The rest are double roots (the camera on the danger cylinder), where rounding may make a
  // solution complex.
  EXPECT_LE(missed, 4);
}

TEST(P3P, SymmetricTriangleSeenFromItsAxis) {
  Problem p;
  for (int i = 0; i < 3; ++i) {
    p.points[i] = {std::cos(2.0944 * i), std::sin(2.0944 * i), 3};
    p.rays[i] = p.points[i].normalized();
  }
  const P3PPoses solved = SolveP3P(p.rays, p.points);
  ASSERT_GE(solved.count, 1);
  double nearest = 1e9;
  for (int i = 0; i < solved.count; ++i)
    nearest = std::min(nearest, solved.poses[i].translation.norm());
  EXPECT_LT(nearest, 1e-4);
}

TEST(P3P, RefusesCollinearPoints) {
  Problem p;
  for (int i = 0; i < 3; ++i) {
    p.points[i] = {i - 1.0, 0, 3};
    p.rays[i] = p.points[i].normalized();
  }
  EXPECT_EQ(SolveP3P(p.rays, p.points).count, 0);
  p.points[2] = p.points[1];
  EXPECT_EQ(SolveP3P(p.rays, p.points).count, 0);
}

TEST(Polynomial, RootsAreRoots) {
  Rng rng(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const double a = rng.Gaussian(1), b = rng.Gaussian(1), c = rng.Gaussian(1), d = rng.Gaussian(1);
    const double x = SolveCubicForOneRoot(a, b, c, d);
    EXPECT_NEAR(((a * x + b) * x + c) * x + d, 0, 1e-9 * (1 + std::abs(a * x * x * x)));
    const RealRoots2 two = SolveQuadratic(a, b, c);
    EXPECT_EQ(two.count, b * b > 4 * a * c ? 2 : 0);
    for (int i = 0; i < two.count; ++i)
      EXPECT_NEAR((a * two.roots[i] + b) * two.roots[i] + c, 0,
                  1e-9 * (1 + std::abs(a * two.roots[i] * two.roots[i])));
  }
}

TEST(Polynomial, CubicWithThreeKnownRoots) {
  // (x - 1)(x - 2)(x - 10): the steepest slope is at 10.
  EXPECT_NEAR(SolveCubicForOneRoot(1, -13, 32, -20), 10, 1e-12);
  EXPECT_NEAR(SolveCubicForOneRoot(0, 0, 2, -4), 2, 1e-12);
}

}  // namespace
}  // namespace oaslam
