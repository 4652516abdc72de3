#include "oaslam/estimation/focal_refinement.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const Camera kTrueCamera{
    .width = 640, .height = 480, .fx = 540, .fy = 540, .cx = 319.5, .cy = 239.5};

std::vector<PointObservation> Observations(const Rigid3& pose, int count, int wrong, double depth,
                                           Rng& rng) {
  std::vector<PointObservation> observations;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d in_cam(rng.Uniform(-1, 1), rng.Uniform(-0.8, 0.8),
                                 rng.Uniform(2, 2 + depth));
    Eigen::Vector2d px =
        ProjectIdeal(kTrueCamera, in_cam) + Eigen::Vector2d(rng.Gaussian(0.5), rng.Gaussian(0.5));
    if (i < wrong) px = {rng.Uniform(0, 640), rng.Uniform(0, 480)};
    observations.push_back({pose.Inverse() * in_cam, px, 4});
  }
  return observations;
}

Camera Off(double factor) {
  Camera camera = kTrueCamera;
  camera.fx *= factor;
  camera.fy *= factor;
  return camera;
}

TEST(FocalRefinement, FindsPoseAndFocalLengthAmongOutliers) {
  Rng rng(3);
  const Rigid3 pose(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())),
      {0.3, -0.2, 0.5});
  const auto observations = Observations(pose, 150, 30, 2.5, rng);
  for (const double factor : {0.85, 1.0, 1.15}) {
    const FocalReport found = RefinePoseAndFocal(Off(factor), pose, observations);
    ASSERT_TRUE(found.success);
    EXPECT_NEAR(found.camera.fx / kTrueCamera.fx, 1, 0.01) << factor;
    EXPECT_LT(std::abs(std::log(found.camera.fx / kTrueCamera.fx)), 4 * found.relative_sigma)
        << factor;
    EXPECT_LT((found.cam_from_world.OriginInSource() - pose.OriginInSource()).norm(), 0.03);
    EXPECT_GE(found.inliers, 100);
  }
}

TEST(FocalRefinement, SaysHowLittleAPlaneTells) {
  Rng rng(4);
  const Rigid3 pose;
  const FocalReport deep =
      RefinePoseAndFocal(kTrueCamera, pose, Observations(pose, 100, 0, 2.5, rng));
  const FocalReport flat =
      RefinePoseAndFocal(kTrueCamera, pose, Observations(pose, 100, 0, 0.02, rng));
  EXPECT_LT(deep.relative_sigma, 0.02);
  EXPECT_GT(flat.relative_sigma, 5 * deep.relative_sigma);
}

TEST(FocalRefinement, RefusesTooFew) {
  Rng rng(5);
  EXPECT_FALSE(RefinePoseAndFocal(kTrueCamera, {}, Observations({}, 6, 0, 2, rng)).success);
}

}  // namespace
}  // namespace oaslam
