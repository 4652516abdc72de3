#include "oaslam/geometry/ideal_image.h"

#include <gtest/gtest.h>

#include <cmath>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// A wide lens whose image has black corners: 190 degrees across its width.
Camera WideFisheye() {
  Camera c{.model = LensModel::kFisheye,
           .width = 800,
           .height = 800,
           .fx = 250,
           .fy = 250,
           .cx = 400,
           .cy = 400};
  c.distortion = {-0.02, 0.01, -0.004, 0, 0};
  return c;
}

// Its radius grows up to 60 degrees only: r (1 - 0.111 r^2) has its maximum at r = 1.73.
Camera FoldingPinhole() {
  Camera c{.width = 640, .height = 480, .fx = 300, .fy = 300, .cx = 320, .cy = 240};
  c.distortion = {-1.0 / 9, 0, 0, 0, 0};
  return c;
}

// Folds at 50 degrees: d theta_d / d theta = 1 + 3 k1 theta^2.
Camera FoldingFisheye() {
  Camera c{.model = LensModel::kFisheye,
           .width = 640,
           .height = 480,
           .fx = 500,
           .fy = 500,
           .cx = 320,
           .cy = 240};
  const double theta = 50 * M_PI / 180;
  c.distortion = {-1 / (3 * theta * theta), 0, 0, 0, 0};
  return c;
}

TEST(IdealImage, TheLensModelEndsWhereItsRadiusStopsGrowing) {
  EXPECT_NEAR(MaxLensAngle(FoldingPinhole()), 60 * M_PI / 180, 1e-3);
  EXPECT_NEAR(MaxLensAngle(FoldingFisheye()), 50 * M_PI / 180, 1e-3);
  EXPECT_GT(MaxLensAngle({.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240}),
            1.5);
}

TEST(IdealImage, PixelsWithinTheModelHaveOneIdealPoint) {
  for (const Camera& camera : {WideFisheye(), FoldingPinhole(), FoldingFisheye()}) {
    const IdealImage image(camera);
    const double max_radius = std::tan(MaxLensAngle(camera));
    int valid = 0, all = 0;
    for (int x = 0; x < camera.width; x += 13)
      for (int y = 0; y < camera.height; y += 13) {
        const Eigen::Vector2d pixel(x, y);
        ++all;
        const auto ideal = image.Undistort(pixel);
        if (!ideal) continue;
        ++valid;
        EXPECT_LT((Distort(camera, *ideal) - pixel).norm(), 1e-3);
        EXPECT_LT(RayOf(camera, *ideal).head<2>().norm(), max_radius);
      }
    EXPECT_GT(valid, all / 3);
    EXPECT_LT(valid, all);  // not the corners
  }
}

TEST(IdealImage, APixelBeyondTheModelHasNoIdealPoint) {
  EXPECT_FALSE(IdealImage(WideFisheye()).Undistort({3, 3}));  // 130 degrees from the axis
  EXPECT_FALSE(
      IdealImage(FoldingFisheye()).Undistort({320 + 305, 240}));  // the radius ends at 291 px
  EXPECT_TRUE(IdealImage(FoldingFisheye()).Undistort({320 + 285, 240}));
}

TEST(IdealImage, ThePointsOutsideThatFoldBackAreNotShown) {
  const Camera camera = FoldingPinhole();
  const IdealImage image(camera);
  const Eigen::Vector2d far(camera.cx + 2.6 * camera.fx, camera.cy);  // 69 degrees off
  const Eigen::Vector2d pixel = Distort(camera, far);
  ASSERT_LT(pixel.x(), camera.width);  // seems to be inside
  EXPECT_FALSE(image.Shows(far));
  EXPECT_TRUE(image.Shows({camera.cx + 0.8 * camera.fx, camera.cy}));
}

TEST(IdealImage, ABoxInACornerOfTheBoundingRectangleIsNotShown) {
  // Barrel distortion: the ideal image of the border bulges out towards the corners, its bounding
  // rectangle more.
  const Camera camera{.width = 640,
                      .height = 480,
                      .fx = 400,
                      .fy = 400,
                      .cx = 320,
                      .cy = 240,
                      .distortion = {-0.3, 0.08, 0, 0, 0}};
  const IdealImage image(camera);
  const Box& bounds = image.bounds();
  const Box beside{camera.cx - 30, bounds.y1 + 1, camera.cx + 30,
                   bounds.y1 + 40};  // above the middle of the upper border
  EXPECT_EQ(ShareInside(beside, bounds), 1);
  EXPECT_LT(image.ShareShown(beside), 0.1);
  const Box middle{300, 200, 360, 280};
  EXPECT_EQ(image.ShareShown(middle), 1);
  const Eigen::Vector2d left = Undistort(camera, {0, 240});
  EXPECT_NEAR(image.ShareShown({left.x() - 20, 220, left.x() + 20, 260}), 0.5, 0.13);
  EXPECT_EQ(image.ShareShown({5, 5, 5, 9}), 0);
}

TEST(IdealImage, WithoutDistortionIsTheImage) {
  const IdealImage image({.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240});
  EXPECT_EQ(*image.Undistort({12.5, 33}), Eigen::Vector2d(12.5, 33));
  EXPECT_NEAR(image.ShareShown({-20, 0, 20, 40}), 0.5, 0.02);
  EXPECT_FALSE(image.Shows({-3, 5}));
}

}  // namespace
}  // namespace oaslam
