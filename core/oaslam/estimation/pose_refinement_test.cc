#include "oaslam/estimation/pose_refinement.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const Camera kRefinedCamera{
    .width = 640, .height = 480, .fx = 520, .fy = 515, .cx = 318, .cy = 242};

Rigid3 RefinedPose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized())),
          {0.3, -0.2, 0.5}};
}

std::vector<PointObservation> Observe(int count, double noise_px, double outlier_share, Rng& rng) {
  const Rigid3 world_from_cam = RefinedPose().Inverse();
  std::vector<PointObservation> observations;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d in_cam =
        RayOf(kRefinedCamera, {rng.Uniform(0, 640), rng.Uniform(0, 480)}) * rng.Uniform(1, 6);
    const double scale = std::pow(1.2, rng.Index(4));
    Eigen::Vector2d px = ProjectIdeal(kRefinedCamera, in_cam);
    px += noise_px * scale * Eigen::Vector2d(rng.Gaussian(1), rng.Gaussian(1));
    if (i < outlier_share * count) px = {rng.Uniform(0, 640), rng.Uniform(0, 480)};
    observations.push_back({world_from_cam * in_cam, px, 1 / (scale * scale)});
  }
  return observations;
}

Rigid3 Disturbed(double translation, double angle_rad) {
  return Rigid3(Eigen::Quaterniond(
                    Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, -1, 1).normalized())),
                Eigen::Vector3d(1, 1, -1).normalized() * translation) *
         RefinedPose();
}

double AngleBetween(const Rigid3& a, const Rigid3& b) {
  return a.rotation.angularDistance(b.rotation);
}

TEST(PoseRefinement, ExactObservationsGiveTheExactPose) {
  Rng rng(1);
  const PoseReport report =
      RefinePose(kRefinedCamera, Disturbed(0.1, 0.05), Observe(50, 0, 0, rng));
  ASSERT_TRUE(report.success);
  EXPECT_EQ(report.inliers, 50);
  EXPECT_LT((report.cam_from_world.translation - RefinedPose().translation).norm(), 1e-6);
  EXPECT_LT(AngleBetween(report.cam_from_world, RefinedPose()), 1e-6);
}

TEST(PoseRefinement, SurvivesOutliersAndClassifiesThem) {
  Rng rng(2);
  const auto observations = Observe(500, 1, 0.3, rng);
  const PoseReport report = RefinePose(kRefinedCamera, Disturbed(0.05, 0.02), observations);
  ASSERT_TRUE(report.success);
  int right = 0;
  for (int i = 0; i < 500; ++i) right += (report.inlier[i] != 0) == (i >= 150);
  EXPECT_GT(right, 470);
  EXPECT_LT((report.cam_from_world.OriginInSource() - RefinedPose().OriginInSource()).norm(), 0.01);
  EXPECT_LT(AngleBetween(report.cam_from_world, RefinedPose()), 0.003);
}

TEST(PoseRefinement, CovarianceCoversTheError) {
  Rng rng(3);
  double sum = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const PoseReport report =
        RefinePose(kRefinedCamera, Disturbed(0.02, 0.01), Observe(60, 1, 0, rng));
    ASSERT_TRUE(report.success);
    const Rigid3 error = RefinedPose() * report.cam_from_world.Inverse();
    Eigen::Matrix<double, 6, 1> e;
    e << error.translation, 2 * error.rotation.vec() * (error.rotation.w() < 0 ? -1 : 1);
    sum += e.dot(report.covariance.ldlt().solve(e));
  }
  EXPECT_NEAR(sum / kRuns, 6, 1.5);  // mean of chi^2 with 6 degrees of freedom
}

TEST(PoseRefinement, FailsWithoutEvidence) {
  Rng rng(4);
  EXPECT_FALSE(RefinePose(kRefinedCamera, RefinedPose(), Observe(5, 0, 0, rng)).success);
  EXPECT_FALSE(RefinePose(kRefinedCamera, RefinedPose(), {}).success);
  EXPECT_LT(RefinePose(kRefinedCamera, Disturbed(0.1, 0.05), Observe(100, 0, 1, rng)).inliers, 15);
  auto behind = Observe(50, 0, 0, rng);
  const Rigid3 turned =
      Rigid3(Eigen::Quaterniond(0, 0, 1, 0), Eigen::Vector3d::Zero()) * RefinedPose();
  EXPECT_FALSE(RefinePose(kRefinedCamera, turned, behind).success);
}

TEST(PoseRefinement, OnePointDoesNotDetermineAPose) {
  std::vector<PointObservation> same(20, {{0, 0, 4}, {318, 242}, 1});
  EXPECT_FALSE(RefinePose(kRefinedCamera, Rigid3(), same).success);
}

// An expected pose stands where there are no points; many points outweigh it.
TEST(PoseRefinement, AnExpectedPoseHoldsWhatPointsDoNot) {
  const ExpectedPose expected{Disturbed(0.02, 0.005), 0.02, 0.005};
  const PoseReport alone = RefinePose(kRefinedCamera, expected.cam_from_world, {}, expected);
  EXPECT_TRUE(alone.success);
  EXPECT_LT((alone.cam_from_world.translation - expected.cam_from_world.translation).norm(), 1e-9);
  EXPECT_NEAR(std::sqrt(alone.covariance(0, 0)), 0.02, 1e-6);
  EXPECT_NEAR(std::sqrt(alone.covariance(5, 5)), 0.005, 1e-6);
  Rng rng(2);
  const PoseReport with_points =
      RefinePose(kRefinedCamera, expected.cam_from_world, Observe(300, 0, 0, rng), expected);
  EXPECT_LT((with_points.cam_from_world.translation - RefinedPose().translation).norm(), 1e-3);
  EXPECT_LT(with_points.covariance(0, 0), alone.covariance(0, 0) / 100);
}

}  // namespace
}  // namespace oaslam
