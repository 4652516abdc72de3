#include "oaslam/estimation/absolute_pose.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

const Camera kCamera{.width = 640, .height = 480, .fx = 520, .fy = 515, .cx = 318, .cy = 242};

Rigid3 TruePose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(1.4, Eigen::Vector3d(1, 2, -1).normalized())),
          {0.3, -0.2, 0.5}};
}

std::vector<PointObservation> Observe(int count, double outlier_share, Rng& rng) {
  const Rigid3 world_from_cam = TruePose().Inverse();
  std::vector<PointObservation> observations;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d in_cam =
        RayOf(kCamera, {rng.Uniform(0, 640), rng.Uniform(0, 480)}) * rng.Uniform(1, 6);
    Eigen::Vector2d px =
        ProjectIdeal(kCamera, in_cam) + Eigen::Vector2d(rng.Gaussian(1), rng.Gaussian(1));
    if (rng.Uniform(0, 1) < outlier_share) px = {rng.Uniform(0, 640), rng.Uniform(0, 480)};
    observations.push_back({world_from_cam * in_cam, px, 1});
  }
  return observations;
}

TEST(AbsolutePose, FindsThePoseAmongManyOutliers) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    const auto observations = Observe(150, 0.7, rng);
    const AbsolutePoseReport report = EstimateAbsolutePose(kCamera, observations, {}, rng);
    ASSERT_TRUE(report.success) << seed;
    EXPECT_GT(report.inliers, 25);
    EXPECT_LT((report.cam_from_world.OriginInSource() - TruePose().OriginInSource()).norm(), 0.05)
        << seed;
    EXPECT_LT(report.cam_from_world.rotation.angularDistance(TruePose().rotation), 0.02) << seed;
  }
}

TEST(AbsolutePose, RefusesNoise) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    EXPECT_FALSE(EstimateAbsolutePose(kCamera, Observe(150, 1, rng), {}, rng).success) << seed;
    EXPECT_FALSE(EstimateAbsolutePose(kCamera, Observe(3, 0, rng), {}, rng).success) << seed;
  }
}

TEST(AbsolutePose, TheSameSeedGivesTheSamePose) {
  Rng rng(3);
  const auto observations = Observe(100, 0.5, rng);
  Rng a(7), b(7);
  const AbsolutePoseReport first = EstimateAbsolutePose(kCamera, observations, {}, a),
                           second = EstimateAbsolutePose(kCamera, observations, {}, b);
  ASSERT_TRUE(first.success && second.success);
  EXPECT_EQ(first.cam_from_world.translation, second.cam_from_world.translation);
}

}  // namespace
}  // namespace oaslam
