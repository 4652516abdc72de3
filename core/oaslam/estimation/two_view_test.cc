#include "oaslam/estimation/two_view.h"

#include <gtest/gtest.h>

#include <numbers>

#include "oaslam/estimation/two_view_models.h"
#include "oaslam/estimation/two_view_refinement.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

const Camera kTwoViewCamera{
    .width = 640, .height = 480, .fx = 520, .fy = 520, .cx = 320, .cy = 240};

struct Scene {
  Rigid3 second_from_first;  // not of unit length
  std::vector<Eigen::Vector2d> first, second;
  std::vector<Eigen::Vector3d> points;
};

enum class Shape { kGeneral, kPlane, kFar };

Rigid3 Motion(const Eigen::Vector3d& center, double angle_rad) {
  const Eigen::Quaterniond r(
      Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(0.2, 1, 0.1).normalized()));
  return {r, r * -center};
}

Scene MakeScene(Shape shape, const Rigid3& motion, int count, double noise_px, double outliers,
                Rng& rng) {
  Scene scene{motion, {}, {}, {}};
  while (static_cast<int>(scene.points.size()) < count) {
    const Eigen::Vector3d ray = RayOf(kTwoViewCamera, {rng.Uniform(0, 640), rng.Uniform(0, 480)});
    const double depth = shape == Shape::kGeneral ? rng.Uniform(1.5, 4)
                         : shape == Shape::kPlane ? 2.5 / (1 + 0.5 * ray.x() + 0.8 * ray.y())
                                                  : rng.Uniform(150, 400);
    const Eigen::Vector3d x = ray * depth, y = motion * x;
    if (y.z() < 0.1) continue;
    const Eigen::Vector2d px = ProjectIdeal(kTwoViewCamera, y);
    if (px.x() < 0 || px.y() < 0 || px.x() > 640 || px.y() > 480) continue;
    const auto noise = [&] {
      // In braces arguments are evaluated in the same order by every compiler.
      return Eigen::Vector2d{rng.Gaussian(noise_px), rng.Gaussian(noise_px)};
    };
    scene.points.push_back(x);
    scene.first.push_back(ProjectIdeal(kTwoViewCamera, x) + noise());
    scene.second.push_back(rng.Uniform(0, 1) < outliers
                               ? Eigen::Vector2d{rng.Uniform(0, 640), rng.Uniform(0, 480)}
                               : Eigen::Vector2d(px + noise()));
  }
  return scene;
}

// With a motion that is nearly right.
TwoViewReport Estimate(const Scene& scene) {
  const Eigen::Quaterniond off(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX()));
  return TriangulateTwoViews(kTwoViewCamera, kTwoViewCamera, scene.first, scene.second,
                             std::vector<double>(scene.first.size(), 1),
                             Rigid3(off * Eigen::Quaterniond(scene.second_from_first.rotation),
                                    3 * scene.second_from_first.translation),
                             {});
}

double RotationErrorDeg(const TwoViewReport& report, const Scene& scene) {
  return report.second_from_first.rotation.angularDistance(scene.second_from_first.rotation) * 180 /
         std::numbers::pi;
}

double DirectionErrorDeg(const TwoViewReport& report, const Scene& scene) {
  const double c =
      report.second_from_first.translation.dot(scene.second_from_first.translation.normalized());
  return std::acos(std::clamp(c, -1.0, 1.0)) * 180 / std::numbers::pi;
}

// Whether the points that were triangulated are where they are, but for some wrong matches.
bool AreDepthsRight(const TwoViewReport& report, const Scene& scene) {
  int checked = 0, bad = 0;
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (!report.points[i]) continue;
    const double depth = report.points[i]->z() * scene.second_from_first.translation.norm();
    bad += std::abs(depth / scene.points[i].z() - 1) > 0.25;
    ++checked;
  }
  EXPECT_EQ(checked, report.triangulated);
  return bad < 0.1 * checked;
}

bool IsMotionRight(const TwoViewReport& report, const Scene& scene, double rotation_deg,
                   double direction_deg) {
  EXPECT_NEAR(report.second_from_first.translation.norm(), 1, 1e-9);
  return RotationErrorDeg(report, scene) < rotation_deg &&
         DirectionErrorDeg(report, scene) < direction_deg;
}

// In front of a plane, too, whose two motions no refinement leads from one to the other.
TEST(TwoView, AMotionIsRefinedAndPointsAreWhereTheyAre) {
  for (const Shape shape : {Shape::kGeneral, Shape::kPlane}) {
    int right = 0;
    constexpr int kScenes = 100;
    for (uint64_t seed = 0; seed < kScenes; ++seed) {
      Rng rng(seed);
      const Scene scene = MakeScene(shape, Motion({0.4, 0.05, 0.1}, -0.05), 300, 0.5, 0.2, rng);
      const TwoViewReport report = Estimate(scene);
      right += report.success && report.triangulated > 150 && IsMotionRight(report, scene, 1, 8) &&
               AreDepthsRight(report, scene);
    }
    EXPECT_GE(right, 0.95 * kScenes) << static_cast<int>(shape);
  }
}

TEST(TwoView, RefusesPureRotation) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    const Scene scene = MakeScene(Shape::kGeneral, Motion({0, 0, 0}, 0.15), 300, 1, 0.1, rng);
    EXPECT_FALSE(Estimate(scene).success) << seed;
  }
}

TEST(TwoView, RefusesLowParallax) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    const Scene scene = MakeScene(Shape::kFar, Motion({0.3, 0, 0.1}, 0.05), 300, 1, 0.1, rng);
    EXPECT_FALSE(Estimate(scene).success) << seed;
  }
}

TEST(TwoView, RefusesUnrelatedMatchesAndTooFew) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    EXPECT_FALSE(
        Estimate(MakeScene(Shape::kGeneral, Motion({0.3, 0, 0}, 0), 300, 1, 1, rng)).success);
    EXPECT_FALSE(
        Estimate(MakeScene(Shape::kGeneral, Motion({0.3, 0, 0}, 0), 7, 0, 0, rng)).success);
  }
}

TEST(TwoView, DecompositionsHoldTheTrueMotion) {
  const Rigid3 motion = Motion({0.3, -0.2, 0.4}, 0.3);
  const Rigid3 unit(motion.rotation, motion.translation.normalized());
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.3, 1).normalized();
  const Eigen::Matrix3d h =
      motion.rotation.toRotationMatrix() + motion.translation * normal.transpose() / 2.0;
  RayMatches matches;
  for (const double x : {-0.3, 0.1, 0.4}) {
    matches.first.emplace_back(x, 0.2, 1);
    matches.second.push_back((h * matches.first.back()));
    matches.second.back() /= matches.second.back().z();
  }
  const auto holds = [&](const std::vector<Rigid3>& motions) {
    for (const Rigid3& m : motions)
      if (m.rotation.angularDistance(unit.rotation) < 1e-6 &&
          (m.translation - unit.translation).norm() < 1e-6)
        return true;
    return false;
  };
  EXPECT_TRUE(holds(MotionsOfHomography(-3 * h, matches)));
  EXPECT_TRUE(holds(MotionsOfEssential(-2 * EssentialOf(unit))));
  EXPECT_TRUE(MotionsOfHomography(motion.rotation.toRotationMatrix(), matches).empty());
}

}  // namespace
}  // namespace oaslam
