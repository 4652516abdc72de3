#include "oaslam/odometry/lens_watch.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const WindowOptions kOptions{.focal_px = 400};
const PoseFitPrior kPrior{.center = {0.1, 0, 0}, .sigma = 0.1};
const Rigid3 kPose(Eigen::Quaterniond::Identity(), {-0.1, 0, 0});

// Points of a room at depths of 1 to 4 whose rays are measured as if the focal length had not
// changed by `change`, the logarithms along width and height; `noise` in pixels.
std::vector<PosePoint> Seen(const Eigen::Vector2d& change, double noise, uint64_t seed) {
  Rng rng(seed);
  std::vector<PosePoint> points;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d direction(rng.Uniform(-0.6, 0.6), rng.Uniform(-0.45, 0.45), 1);
    const double inverse_depth = 1 / rng.Uniform(1, 4);
    const Eigen::Vector3d x = kPose * (direction / inverse_depth);
    PosePoint& point =
        points.emplace_back(PosePoint{direction, Eigen::Vector3d::Zero(), inverse_depth, 1e-6});
    point.ray = change.array().exp().matrix().cwiseProduct(x.head<2>() / x.z());
    for (double& v : point.ray) v += rng.Gaussian(noise / kOptions.focal_px);
  }
  return points;
}

FocalChange ChangeOf(const Eigen::Vector2d& change, double noise, uint64_t seed) {
  return FocalChangeOf(Seen(change, noise, seed), kOptions, kPrior, kPose);
}

TEST(LensWatch, MeasuresAChangeOfTheFocalLengthWithItsSigma) {
  for (const double change : {-0.03, 0.0, 0.02}) {
    double squares = 0;
    for (uint64_t seed = 1; seed <= 20; ++seed) {
      const FocalChange found = ChangeOf({change, change}, 0.7, seed);
      EXPECT_LT(found.sigma, 0.01);
      squares += std::pow((found.both - change) / found.sigma, 2) / 20;
    }
    EXPECT_LT(squares, 2.5) << change;
  }
  EXPECT_NEAR(ChangeOf({0.02, 0.02}, 0.1, 1).Sure(), 0.02, 0.012);
}

TEST(LensWatch, AStretchOfOneAxisIsNoZoom) {
  EXPECT_GT(std::abs(ChangeOf({0.03, 0.03}, 0.3, 1).Sure()), 0);
  EXPECT_EQ(ChangeOf({0, 0.03}, 0.3, 1).Sure(), 0);  // a rolling shutter
  EXPECT_EQ(ChangeOf({0.03, -0.03}, 0.3, 1).Sure(), 0);
}

FocalChange Shown(double change) { return {{change, change}, {0.0005, 0.0005}, change, 0.0005}; }

TEST(LensWatch, ALensThatStaysKeepsItsRatioExactly) {
  LensWatch watch;
  Rng rng(3);
  for (int i = 0; i < 300; ++i) {
    // An image may be measured wrongly, two in a row may, too.
    const double change = i % 50 < 2 ? 0.03 : rng.Gaussian(0.001);
    EXPECT_FALSE(watch.Add(Shown(change), i / 30.0));
    EXPECT_EQ(watch.ratio(), 1);
  }
}

TEST(LensWatch, FollowsAZoomAndRestsWhereItEnds) {
  LensWatch watch;
  double log_focal = 0;
  int followed = 0;
  for (int i = 0; i < 150; ++i) {
    if (i >= 30 && i < 60) log_focal += 0.012;
    const double off = log_focal - std::log(watch.ratio());
    followed += watch.Add(Shown(off), i / 30.0);
    if (i < 30) EXPECT_EQ(watch.ratio(), 1);
  }
  EXPECT_NEAR(std::log(watch.ratio()), log_focal, 0.005);
  EXPECT_GE(followed, 30);
  EXPECT_FALSE(watch.is_followed());
  watch.Replace(0.5);
  EXPECT_EQ(watch.ratio(), 0.5);
  EXPECT_FALSE(watch.is_followed());
}

}  // namespace
}  // namespace oaslam
