// In which worlds a camera has poses that loses one map, begins another, and sees both again.
#include <gtest/gtest.h>

#include <optional>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/slam.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

class WorldsTest : public testing::Test {
 protected:
  enum class Seen { kFirstHalf, kSecondHalf, kAll };

  static SlamConfig Config() {
    SlamConfig config = SlamConfig::Offline();
    config.runner.mode = RunnerMode::kSequential;
    return config;
  }
  static Rigid3 CamFromWorld(int place) { return synthetic::PoseOnArc({}, -20 + 0.4 * place); }

  WorldsTest() {
    for (size_t i = 0; i < all_.points.size(); ++i) {
      synthetic::World& half = halves_[i % 2];
      half.points.push_back(all_.points[i]);
      half.descriptors.push_back(all_.descriptors[i]);
      half.max_distance.push_back(all_.max_distance[i]);
      half.angles_rad.push_back(all_.angles_rad[i]);
    }
    for (synthetic::World& half : halves_) half.camera = all_.camera;
  }

  // The next image, taken from this place on the arc. The motion of each `walk` has a frame and a
  // unit of its own.
  TrackingResult Process(int place, Seen seen, int walk) {
    const synthetic::World& world = seen == Seen::kAll ? all_ : halves_[seen == Seen::kSecondHalf];
    const double unit = 1 + 0.5 * walk;
    const synthetic::View view =
        synthetic::MakeView(world, CamFromWorld(place), {.missed = 0.1}, rng_);
    ImageInput input;
    input.timestamp = images_ / 30.0;
    input.features.emplace();
    input.features->lowest_pixel = view.features->pyramid.working_pixel();
    for (int k = 0; k < view.features->size(); ++k) {
      const Keypoint& point = view.features->keypoints[k];
      input.features->features.push_back(
          {point.px, point.angle_rad, point.octave, view.features->descriptors[k]});
    }
    input.motion.emplace();
    input.motion->run = walk;
    input.motion->image = images_++;
    input.motion->odom_from_cam = CamFromWorld(40 * walk) * CamFromWorld(place).Inverse();
    input.motion->odom_from_cam.translation /= unit;
    input.motion->is_keyframe = images_ % 5 == 0;
    for (const Eigen::Vector3d& point : world.points) {
      const Eigen::Vector3d in_cam = CamFromWorld(place) * point;
      if (in_cam.z() > 0)
        input.motion->depths.push_back(
            {Distort(world.camera, ProjectIdeal(world.camera, in_cam)), unit / in_cam.z()});
    }
    return slam_.Process(input);
  }

  static void ExpectNear(const std::optional<Rigid3>& pose, const std::optional<Rigid3>& expected,
                         double tolerance) {
    ASSERT_TRUE(pose && expected);
    EXPECT_LT((pose->translation - expected->translation).norm(), tolerance);
    EXPECT_LT(pose->rotation.angularDistance(expected->rotation), 0.02);
  }

  const synthetic::World all_ = synthetic::MakeWorld({.points = 1200});
  synthetic::World halves_[2];
  Rng rng_{7};
  Slam slam_{Config(), all_.camera};
  int images_ = 0;
};

TEST_F(WorldsTest, ACameraThatIsLostHasAPoseInTheMapThatBegins) {
  TrackingResult last;
  for (int i = 0; i < 60; ++i) last = Process(i, Seen::kFirstHalf, 0);
  const WorldId first = last.world;
  ASSERT_TRUE(last.PoseIn(first));
  EXPECT_TRUE(last.elsewhere.empty());
  for (int i = 58; i >= 30; --i) last = Process(i, Seen::kFirstHalf, 0);
  const std::optional<Rigid3> at_30 = last.PoseIn(first);
  ASSERT_TRUE(at_30);

  WorldId second;
  int images_in_second = 0;
  for (int i = 0; i < 150; ++i) {
    last = Process(i % 100 < 50 ? 31 + i % 50 : 80 - i % 50, Seen::kSecondHalf, 1);
    if (last.world != first || last.elsewhere.empty()) continue;
    ++images_in_second;
    second = last.elsewhere[0].world;
    EXPECT_NE(second, first);
    EXPECT_FALSE(last.HasPose());
    EXPECT_TRUE(last.PoseIn(second));
    EXPECT_FALSE(last.PoseIn(first));
    EXPECT_GT(last.elsewhere[0].covariance.trace(), 0);
  }
  EXPECT_GT(images_in_second, 5);
  EXPECT_EQ(last.world, second);  // the larger one is the main one by now

  for (int i = 81; i >= 30; --i) Process(i, Seen::kAll, 2);
  slam_.Finish();
  last = Process(30, Seen::kAll, 2);
  ASSERT_EQ(last.world, second);
  ASSERT_TRUE(last.PoseIn(second));
  EXPECT_FALSE(last.PoseIn(WorldId(second.value + 1000)));
  ExpectNear(last.PoseIn(first), at_30, 0.1);
  ASSERT_EQ(last.elsewhere.size(), 1u);
  EXPECT_NEAR(last.elsewhere[0].covariance(0, 0) / last.covariance(0, 0), 1.5 * 1.5, 0.3);
}

}  // namespace
}  // namespace oaslam
