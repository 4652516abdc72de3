#include "oaslam/geometry/camera_derivatives.h"

#include <gtest/gtest.h>

#include "cameras.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

TEST(CameraDerivatives, AgreeWithDifferences) {
  constexpr double kStep = 1e-6;
  for (const Camera& camera : {synthetic::kPinhole, synthetic::kFisheye}) {
    for (const Eigen::Vector3d& x :
         {Eigen::Vector3d(0.3, -0.4, 1.7), Eigen::Vector3d(-1, 0.2, 2), Eigen::Vector3d(0, 0, 1)}) {
      const PixelDerivatives d = PixelWithDerivatives(camera, x);
      EXPECT_LT((d.px - PixelOf(camera, x)).norm(), 1e-9);
      EXPECT_LT((Undistort(camera, d.px) - ProjectIdeal(camera, x)).norm(), 1e-6);
      for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
        const Eigen::Vector2d by =
            (PixelOf(camera, x + step) - PixelOf(camera, x - step)) / (2 * kStep);
        EXPECT_LT((d.by_point.col(i) - by).norm(), 1e-5 * camera.fx) << i;
      }
      for (int i = 0; i < kIntrinsics; ++i) {
        const IntrinsicsStep step = kStep * IntrinsicsStep::Unit(i);
        const Eigen::Vector2d by = (PixelOf(WithIntrinsicsStep(camera, step), x) -
                                    PixelOf(WithIntrinsicsStep(camera, -step), x)) /
                                   (2 * kStep);
        EXPECT_LT((d.by_intrinsics.col(i) - by).norm(), 1e-5 * camera.fx) << i;
      }
    }
  }
}

}  // namespace
}  // namespace oaslam
