#include "oaslam/estimation/pose_by_matches.h"

#include <gtest/gtest.h>

#include <vector>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const Camera kMatchesCamera{
    .width = 640, .height = 480, .fx = 520, .fy = 520, .cx = 320, .cy = 240};

struct TwoFrames {
  Rigid3 before, truth{Eigen::Quaterniond(Eigen::AngleAxisd(0.08, Eigen::Vector3d::UnitY())),
                       {0.04, 0.005, 0.03}};
  std::vector<PointObservation> landmarks;
  std::vector<EpipolarMatch> matches;

  // Few landmarks in the left corner, matches all over the image, a tenth of them wrong.
  explicit TwoFrames(double noise_px) {
    Rng rng(3);
    const auto noise = [&]() -> Eigen::Vector2d {
      return Eigen::Vector2d(rng.Uniform(-1, 1), rng.Uniform(-1, 1)) * noise_px;
    };
    for (int i = 0; i < 400; ++i) {
      const bool is_landmark = i < 25;
      const Eigen::Vector2d px(is_landmark ? rng.Uniform(20, 110) : rng.Uniform(10, 630),
                               rng.Uniform(10, is_landmark ? 120 : 470));
      const Eigen::Vector3d x = rng.Uniform(1.5, 5) * RayOf(kMatchesCamera, px), y = truth * x;
      if (is_landmark) {
        landmarks.push_back({x, ProjectIdeal(kMatchesCamera, y) + noise(), 1});
        continue;
      }
      Eigen::Vector2d seen = ProjectIdeal(kMatchesCamera, y) + noise();
      if (i % 10 == 0) seen += Eigen::Vector2d(rng.Uniform(-30, 30), rng.Uniform(-30, 30));
      matches.push_back({RayOf(kMatchesCamera, px + noise()), RayOf(kMatchesCamera, seen), 1});
    }
  }
};

double AngleDeg(const Rigid3& a, const Rigid3& b) {
  return a.rotation.angularDistance(b.rotation) * 180 / M_PI;
}

TEST(PoseByMatches, MatchesHoldTheRotationWhereLandmarksAreInOneCorner) {
  const TwoFrames f(1.5);
  const Rigid3 guess =
      Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX())), {0.01, 0, 0}) *
      f.truth;
  const PoseReport alone = RefinePose(kMatchesCamera, guess, f.landmarks);
  const PoseReport both =
      RefinePoseByMatches(kMatchesCamera, guess, f.landmarks, f.before, f.matches);
  ASSERT_TRUE(alone.success);
  ASSERT_TRUE(both.success);
  EXPECT_LT(AngleDeg(both.cam_from_world, f.truth), 0.15);
  EXPECT_LT(AngleDeg(both.cam_from_world, f.truth), AngleDeg(alone.cam_from_world, f.truth));
  EXPECT_LT(both.covariance.trace(), alone.covariance.trace());
}

TEST(PoseByMatches, WithoutMatchesItIsThePoseOfTheLandmarks) {
  const TwoFrames f(0.3);
  const PoseReport alone = RefinePose(kMatchesCamera, f.truth, f.landmarks);
  const PoseReport both = RefinePoseByMatches(kMatchesCamera, f.truth, f.landmarks, f.before, {});
  ASSERT_TRUE(both.success);
  EXPECT_LT(AngleDeg(both.cam_from_world, alone.cam_from_world), 0.02);
}

TEST(PoseByMatches, ACameraThatStandsStillIsNoError) {
  TwoFrames f(0);
  for (PointObservation& o : f.landmarks) o.px = ProjectIdeal(kMatchesCamera, f.before * o.point);
  for (EpipolarMatch& m : f.matches) m.ray = m.ray_before;
  const PoseReport report =
      RefinePoseByMatches(kMatchesCamera, f.before, f.landmarks, f.before, f.matches);
  ASSERT_TRUE(report.success);
  EXPECT_LT(report.cam_from_world.translation.norm(), 1e-6);
}

}  // namespace
}  // namespace oaslam
