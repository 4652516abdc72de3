#include "oaslam/geometry/ellipsoid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid_jacobian.h"
#include "oaslam/geometry/up2p.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

Camera TestCamera() {
  return {.width = 640, .height = 480, .fx = 520, .fy = 515, .cx = 325, .cy = 250};
}

Eigen::Quaterniond RandomRotation(Rng& rng) {
  return Eigen::Quaterniond(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1))
      .normalized();
}

struct Scene {
  Ellipsoid ellipsoid;
  Rigid3 cam_from_world;
};

Scene RandomScene(Rng& rng) {
  Scene s;
  s.cam_from_world = {RandomRotation(rng),
                      {rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-3, 3)}};
  s.ellipsoid.center = s.cam_from_world.Inverse() *
                       Eigen::Vector3d(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(1.5, 4));
  s.ellipsoid.half_axes = {rng.Uniform(0.1, 0.6), rng.Uniform(0.1, 0.6), rng.Uniform(0.1, 0.6)};
  s.ellipsoid.rotation = RandomRotation(rng);
  return s;
}

TEST(Ellipsoid, BoxAndEllipseBoundItsSurface) {
  Rng rng(1);
  const Camera camera = TestCamera();
  for (int trial = 0; trial < 50; ++trial) {
    const Scene s = RandomScene(rng);
    const auto box = ProjectToBox(s.ellipsoid, s.cam_from_world, camera);
    const auto ellipse = ProjectToEllipse(s.ellipsoid, s.cam_from_world, camera);
    ASSERT_TRUE(box && ellipse);
    const Box from_ellipse = BoundingBox(*ellipse);
    EXPECT_LT((Edges(*box) - Edges(from_ellipse)).norm(), 1e-9);
    Box sampled{1e9, 1e9, -1e9, -1e9};
    const Eigen::Matrix2d inverse = ellipse->covariance.inverse();
    double largest = 0;
    for (int i = 0; i < 200; ++i)
      for (int j = 0; j < 400; ++j) {
        const double theta = std::numbers::pi * i / 199, phi = 2 * std::numbers::pi * j / 400;
        const Eigen::Vector3d unit(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                   std::cos(theta));
        const Eigen::Vector2d px = ProjectIdeal(
            camera, s.cam_from_world * (s.ellipsoid.center + ScaledAxes(s.ellipsoid) * unit));
        sampled = {std::min(sampled.x1, px.x()), std::min(sampled.y1, px.y()),
                   std::max(sampled.x2, px.x()), std::max(sampled.y2, px.y())};
        const Eigen::Vector2d offset = px - ellipse->mean;
        largest = std::max(largest, offset.dot(inverse * offset));
      }
    const Eigen::Vector4d in_box_units = Edges(sampled).array() + kBoxFromPixel;
    EXPECT_LT((Edges(*box) - in_box_units).norm(), 0.01 * SizeOf(*box));
    EXPECT_LT(largest, 1 + 1e-9);  // the surface fills the ellipse exactly
    EXPECT_GT(largest, 0.999);
  }
}

TEST(Ellipsoid, OnlyWhollyInFrontProjects) {
  const Camera camera = TestCamera();
  Ellipsoid e{.center = {0, 0, 3}, .half_axes = {0.2, 0.2, 0.5}};
  EXPECT_TRUE(ProjectToBox(e, Rigid3(), camera));
  e.center.z() = 0.4;  // the principal plane cuts it
  EXPECT_FALSE(ProjectToBox(e, Rigid3(), camera));
  e.center.z() = -3;  // behind
  EXPECT_FALSE(ProjectToBox(e, Rigid3(), camera));
  EXPECT_FALSE(ViewEllipsoid(e, Rigid3()));
}

TEST(Ellipsoid, JacobiansAreDerivatives) {
  Rng rng(2);
  const Camera camera = TestCamera();
  const double h = 1e-6;
  const auto edges = [&](const Ellipsoid& e, const Rigid3& pose) {
    return Edges(*ProjectToBox(e, pose, camera));
  };
  const auto moments = [&](const Ellipsoid& e, const Rigid3& pose) {
    const Ellipse p = *ProjectToEllipse(e, pose, camera);
    Eigen::Matrix<double, 5, 1> m;
    m << p.mean, p.covariance(0, 0), p.covariance(0, 1), p.covariance(1, 1);
    return m;
  };
  for (int trial = 0; trial < 20; ++trial) {
    const Scene s = RandomScene(rng);
    const auto view = ViewEllipsoid(s.ellipsoid, s.cam_from_world);
    ASSERT_TRUE(view);
    const EdgesByShape by_shape = DifferentiateByShape(*view, camera);
    const EllipseByShape of_ellipse = DifferentiateEllipse(*view, camera);
    for (int k = 0; k < kShapeParameters; ++k) {
      const Ellipsoid plus = Moved(s.ellipsoid, h * ShapeVector::Unit(k)),
                      minus = Moved(s.ellipsoid, -h * ShapeVector::Unit(k));
      const Eigen::Vector4d numeric =
          (edges(plus, s.cam_from_world) - edges(minus, s.cam_from_world)) / (2 * h);
      EXPECT_LT((by_shape.col(k) - numeric).norm(), 1e-4 * (1 + numeric.norm())) << k;
      const auto numeric_moments =
          ((moments(plus, s.cam_from_world) - moments(minus, s.cam_from_world)) / (2 * h)).eval();
      EXPECT_LT((of_ellipse.col(k) - numeric_moments).norm(), 1e-4 * (1 + numeric_moments.norm()))
          << k;
    }
    const EdgesByPose by_pose = DifferentiateByPose(*view, camera);
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector4d numeric =
          (edges(s.ellipsoid, Moved(s.cam_from_world, h * PoseVector::Unit(k))) -
           edges(s.ellipsoid, Moved(s.cam_from_world, -h * PoseVector::Unit(k)))) /
          (2 * h);
      EXPECT_LT((by_pose.col(k) - numeric).norm(), 1e-4 * (1 + numeric.norm())) << k;
    }
  }
}

TEST(Ellipsoid, BoxesInSpace) {
  const Ellipsoid a{.center = {0, 0, 0}, .half_axes = {1, 2, 3}};
  EXPECT_NEAR(IoU(BoundingBox(a), BoundingBox(a)), 1, 1e-12);
  const Ellipsoid shifted{.center = {1, 0, 0}, .half_axes = {1, 2, 3}};
  EXPECT_NEAR(IoU(BoundingBox(a), BoundingBox(shifted)), 1.0 / 3, 1e-12);
  const Ellipsoid far{.center = {5, 5, 5}, .half_axes = {1, 1, 1}};
  EXPECT_EQ(IoU(BoundingBox(a), BoundingBox(far)), 0);
  EXPECT_TRUE(Contains(a, {0.5, 1, 0}));
  EXPECT_FALSE(Contains(a, {1.1, 0, 0}));
}

TEST(Box, OverlapAndShare) {
  const Box a{0, 0, 10, 10}, b{5, 0, 15, 10};
  EXPECT_NEAR(IoU(a, b), 1.0 / 3, 1e-12);
  EXPECT_EQ(IoU(a, {20, 20, 30, 30}), 0);
  EXPECT_EQ(IoU({1, 1, 1, 1}, {1, 1, 1, 1}), 0);
  EXPECT_NEAR(ShareInside(b, a), 0.5, 1e-12);
  EXPECT_EQ(ShareInside({3, 3, 3, 5}, a), 0);
}

TEST(Ellipse, WassersteinOfAlignedEllipsesIsEuclidean) {
  const Ellipse a = InscribedEllipse({0, 0, 20, 40}), b = InscribedEllipse({3, 4, 43, 30});
  const Eigen::Vector4d difference(b.mean.x() - a.mean.x(), b.mean.y() - a.mean.y(), 20 - 10,
                                   13 - 20);
  EXPECT_NEAR(SquaredWasserstein(a, b), difference.squaredNorm(), 1e-9);
  EXPECT_NEAR(SquaredWasserstein(a, a), 0, 1e-9);
}

TEST(Up2P, FindsTheTruePose) {
  Rng rng(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const Rigid3 truth(RandomRotation(rng),
                       Eigen::Vector3d(rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-3, 3)));
    const Eigen::Vector3d up_in_world =
        (RandomRotation(rng) * Eigen::Vector3d::UnitX()).normalized();
    std::array<Eigen::Vector3d, 2> rays, points;
    for (int i = 0; i < 2; ++i) {
      rays[i] = {rng.Uniform(-1, 1), rng.Uniform(-1, 1), 1};
      points[i] = truth.Inverse() * (rng.Uniform(1, 5) * rays[i]);
    }
    const Up2PPoses solved = SolveUp2P(rays, truth.rotation * up_in_world, points, up_in_world);
    double nearest = 1e9;
    for (int i = 0; i < solved.count; ++i) {
      nearest = std::min(nearest, (solved.poses[i].translation - truth.translation).norm() +
                                      solved.poses[i].rotation.angularDistance(truth.rotation));
      for (int k = 0; k < 2; ++k)
        EXPECT_LT((solved.poses[i] * points[k]).normalized().cross(rays[k].normalized()).norm(),
                  1e-6);
    }
    EXPECT_LT(nearest, 1e-5) << trial;
  }
}

TEST(Up2P, RefusesPointsOnOneVertical) {
  const std::array<Eigen::Vector3d, 2> points = {Eigen::Vector3d(0, 0, 3),
                                                 Eigen::Vector3d(0, 1, 3)};
  EXPECT_EQ(SolveUp2P(points, -Eigen::Vector3d::UnitY(), points, -Eigen::Vector3d::UnitY()).count,
            0);
}

}  // namespace
}  // namespace oaslam
