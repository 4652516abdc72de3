#include "oaslam/objects/box_motion.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

const Camera kMotionCamera{.width = 640, .height = 480, .fx = 520, .fy = 520, .cx = 320, .cy = 240};

// A small ball seen from two places: the camera steps aside and turns, so that the boxes are apart.
struct TwoViews {
  Rigid3 now_from_then;
  Box then, now;
};

TwoViews Step(const Ellipsoid& ball) {
  const Rigid3 then_from_world;
  const Rigid3 now_from_world(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.2, 1, 0).normalized())),
      {-0.3, 0.05, 0.1});
  return {now_from_world * then_from_world.Inverse(),
          *ProjectToBox(ball, then_from_world, kMotionCamera),
          *ProjectToBox(ball, now_from_world, kMotionCamera)};
}

Ellipsoid Ball(const Eigen::Vector3d& center) {
  return {center, Eigen::Vector3d::Constant(0.05), Eigen::Quaterniond::Identity()};
}

TEST(BoxMotion, AtTheTrueDepthTheBoxLiesOnTheDetection) {
  const TwoViews views = Step(Ball({0.1, -0.1, 2}));
  EXPECT_EQ(IoU(views.then, views.now), 0);
  EXPECT_GT(IoU(BoxAfterMotion(views.then, views.now_from_then, 1 / 2.0, kMotionCamera), views.now),
            0.9);
}

TEST(BoxMotion, TheDepthIsFound) {
  for (const double depth : {0.8, 2.0, 10.0}) {
    const TwoViews views = Step(Ball({0.05 * depth, -0.05 * depth, depth}));
    const MotionSinceBox motion{views.now_from_then, 0.5};
    EXPECT_GT(OverlapAfterMotion(views.then, views.now, 0, motion, kMotionCamera), 0.85) << depth;
  }
}

TEST(BoxMotion, WhatIsBesideTheEpipolarLineDoesNotOverlap) {
  const TwoViews views = Step(Ball({0.1, -0.1, 2}));
  Box beside = views.now;
  beside.y1 += 40;
  beside.y2 += 40;
  EXPECT_EQ(OverlapAfterMotion(views.then, beside, 0, {views.now_from_then, 0.5}, kMotionCamera),
            0);
}

TEST(BoxMotion, NothingIsNearerThanTheLeastDepth) {
  const TwoViews views = Step(Ball({0.1, -0.1, 2}));
  EXPECT_LT(OverlapAfterMotion(views.then, views.now, 0, {views.now_from_then, 20}, kMotionCamera),
            0.3);
}

TEST(BoxMotion, ACameraThatOnlyTurnsLeavesNoDepthToFind) {
  const Rigid3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())),
                      Eigen::Vector3d::Zero());
  const Ellipsoid ball = Ball({0.1, -0.1, 2});
  const Box then = *ProjectToBox(ball, Rigid3(), kMotionCamera),
            now = *ProjectToBox(ball, turned, kMotionCamera);
  EXPECT_EQ(IoU(then, now), 0);
  EXPECT_GT(OverlapAfterMotion(then, now, 0, {turned, 0.5}, kMotionCamera), 0.8);
}

TEST(BoxMotion, WhatIsBehindTheCameraAfterwardsHasNoBox) {
  const Rigid3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY())),
                      Eigen::Vector3d::Zero());
  EXPECT_EQ(BoxAfterMotion({300, 200, 340, 260}, turned, 0.5, kMotionCamera).Area(), 0);
}

}  // namespace
}  // namespace oaslam
