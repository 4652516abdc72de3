#include "oaslam/geometry/camera_model.h"

#include <gtest/gtest.h>

#include "cameras.h"

namespace oaslam {
namespace {

TEST(CameraModel, UndistortionInvertsDistortionOverTheImage) {
  for (const Camera& camera : {synthetic::kPinhole, synthetic::kFisheye}) {
    for (int x = 0; x < camera.width; x += 53)
      for (int y = 0; y < camera.height; y += 53) {
        const Eigen::Vector2d pixel(x, y);
        if ((pixel - Eigen::Vector2d(camera.cx, camera.cy)).norm() > 1.4 * camera.fx)
          continue;  // no pinhole image
        const Eigen::Vector2d back = Distort(camera, Undistort(camera, pixel));
        EXPECT_LT((back - pixel).norm(), 1e-6) << pixel.transpose();
      }
  }
}

TEST(CameraModel, WithoutDistortionAPixelStaysWhereItIs) {
  const Camera camera{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};
  EXPECT_EQ(Undistort(camera, {12.5, 33}), Eigen::Vector2d(12.5, 33));
  EXPECT_EQ(UndistortBox(camera, {1, 2, 30, 40}), (Box{1, 2, 30, 40}));
}

TEST(CameraModel, RayAndProjectionAreInverse) {
  const Camera camera = synthetic::kPinhole;
  EXPECT_LT(
      (ProjectIdeal(camera, RayOf(camera, {100, 400}) * 3.2) - Eigen::Vector2d(100, 400)).norm(),
      1e-9);
}

TEST(CameraModel, EdgesAtTheBorderAreTruncated) {
  const Camera camera = synthetic::kPinhole;
  EXPECT_EQ(TruncatedEdges(camera, {1, 50, 100, 480}), kLeft | kBottom);
  EXPECT_EQ(TruncatedEdges(camera, {50, 50, 100, 400}), 0);
}

TEST(CameraModel, BoundsOfTheIdealImageHoldEveryPixel) {
  const Camera camera = synthetic::kPinhole;
  const Box bounds = IdealImageBounds(camera);
  for (int x = 0; x < camera.width; x += 71) {
    const Eigen::Vector2d p = Undistort(camera, {x, 0});
    EXPECT_GE(p.y() + 1e-3, bounds.y1);
    EXPECT_LE(p.x() - 1e-3, bounds.x2);
  }
}

}  // namespace
}  // namespace oaslam
