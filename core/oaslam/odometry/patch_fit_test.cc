#include "oaslam/odometry/patch_fit.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>

#include "grey_scene.h"
#include "oaslam/odometry/grey_pyramid.h"
#include "oaslam/odometry/patch_flow.h"

namespace oaslam {
namespace {

constexpr int kAcross = 160, kDown = 120;

using GreyScene = std::function<double(const Eigen::Vector2d&)>;  // grey value at a place

// The scene as it is seen where its place x is at middle + stretch * (x - middle) + shift.
GreyPyramid SeenScene(const GreyScene& scene, const Eigen::Matrix2d& stretch,
                      const Eigen::Vector2d& shift, double gain = 1, double brightness = 0) {
  const Eigen::Vector2d middle(80, 60);
  const GreyBuffer seen = synthetic::Drawn(kAcross, kDown, [&](int x, int y) {
    const Eigen::Vector2d at =
        middle + stretch.inverse() * (Eigen::Vector2d(x, y) - shift - middle);
    return std::lround(std::clamp(brightness + gain * scene(at), 0.0, 255.0));
  });
  return GreyPyramid(seen.view(), 3);
}

double Waves(const Eigen::Vector2d& p) {
  return 120 + 35 * std::sin(0.51 * p.x() + 0.21 * p.y()) +
         30 * std::sin(0.57 * p.y() - 0.17 * p.x());
}

// A bright corner at (80, 60) on a dark ground.
double Corner(const Eigen::Vector2d& p) {
  const auto side = [](double x) { return 1 / (1 + std::exp(-1.5 * x)); };
  return 60 + 120 * side(p.x() - 80) * side(p.y() - 60);
}

const Eigen::Matrix2d kNoStretch = Eigen::Matrix2d::Identity();

TEST(FitPatch, FindsPlaceAndStretchWhateverTheBrightness) {
  Eigen::Matrix2d stretch;
  stretch << 1.15, 0.1, -0.08, 0.9;
  const GreyPyramid first = SeenScene(Waves, kNoStretch, {0, 0}),
                    second = SeenScene(Waves, stretch, {3.3, -2.6}, 0.7, 20);
  const auto fit = FitPatch(first.level(0), {80, 60}, second.level(0), {{82.7F, 57.9F}});
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->pose.px - Eigen::Vector2f(83.3F, 57.4F)).norm(), 0.05);
  EXPECT_LT((fit->pose.stretch - stretch.cast<float>()).norm(), 0.05);
  EXPECT_GT(fit->correlation, 0.995);
}

// From the side the corner has another angle: a patch that may only move comes to lie beside it.
TEST(FitPatch, StaysOnACornerThatIsSeenFromTheSide) {
  Eigen::Matrix2d stretch;
  stretch << 0.8, 0, 0.25, 1;
  const GreyPyramid first = SeenScene(Corner, kNoStretch, {0, 0}),
                    second = SeenScene(Corner, stretch, {0, 0});
  const Eigen::Vector2f px(80, 60);
  const auto moved = FollowPatch(first, second, px, px, {.levels = 1});
  const auto fit = FitPatch(first.level(0), px, second.level(0), {px});
  ASSERT_TRUE(moved && fit);
  EXPECT_GT((*moved - px).norm(), 0.3);
  EXPECT_LT((fit->pose.px - px).norm(), 0.5 * (*moved - px).norm());
}

TEST(FitPatch, SaysWhatIsNotAlike) {
  const auto hidden = [](const Eigen::Vector2d& p) { return p.y() > 61 ? 40.0 : Corner(p); };
  const GreyPyramid first = SeenScene(Corner, kNoStretch, {0, 0}),
                    second = SeenScene(hidden, kNoStretch, {0, 0});
  const auto fit = FitPatch(first.level(0), {80, 60}, second.level(0), {{80, 60}});
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->correlation, 0.8);
}

TEST(FitPatch, NeedsAPatchWithinTheImages) {
  const GreyPyramid waves = SeenScene(Waves, kNoStretch, {0, 0});
  const GreyPyramid grey = SeenScene([](const auto&) { return 90.0; }, kNoStretch, {0, 0});
  const GreyImage image = waves.level(0);
  EXPECT_FALSE(FitPatch(image, {80, 60}, image, {{-30, 60}}));
  EXPECT_FALSE(FitPatch(image, {kAcross + 20.0F, 60}, image, {{80, 60}}));
  EXPECT_FALSE(FitPatch(grey.level(0), {80, 60}, grey.level(0), {{80, 60}}));
  EXPECT_TRUE(FitPatch(image, {0, 0}, image, {{0, 0}}));  // the pixels beyond the edge are known
}

}  // namespace
}  // namespace oaslam
