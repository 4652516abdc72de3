#include "expect_input_error.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/slam.h"
#include "offline_config.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

// A camera on an arc, of which an application gives no images: only key points and the motion.
class GivenInputTest : public testing::Test {
 protected:
  static constexpr double kUnitGiven = 0.4;  // of the application's odometry, in units of the world

  static Rigid3 CamFromWorld(int i) { return synthetic::PoseOnArc({}, -20 + 0.4 * i); }

  // An image that is taken from a place on the arc has these, as ImageInput gives them.
  ImageFeatures FeaturesAt(int place, const synthetic::World& world) {
    const synthetic::View view =
        synthetic::MakeView(world, CamFromWorld(place), {.missed = 0.1}, rng_);
    ImageFeatures given;
    given.lowest_pixel = view.features->pyramid.working_pixel();
    for (int k = 0; k < view.features->size(); ++k) {
      const Keypoint& point = view.features->keypoints[k];
      given.features.push_back(
          {point.px, point.angle_rad, point.octave, view.features->descriptors[k]});
    }
    return given;
  }
  // An odometry with this unit tells this motion from one place to another.
  static MotionInput MotionSince(int first, int place, const synthetic::World& world, double unit) {
    MotionInput motion;
    motion.odom_from_cam = CamFromWorld(first) * CamFromWorld(place).Inverse();
    motion.odom_from_cam.translation /= unit;
    for (const Eigen::Vector3d& point : world.points) {
      const Eigen::Vector3d in_cam = CamFromWorld(place) * point;
      if (in_cam.z() > 0)
        motion.depths.push_back(
            {Distort(world.camera, ProjectIdeal(world.camera, in_cam)), unit / in_cam.z()});
    }
    return motion;
  }
  ImageInput InputAt(int i) {
    ImageInput input;
    input.timestamp = i / 30.0;
    input.features = FeaturesAt(i, world_);
    input.motion = MotionSince(0, i, world_, kUnitGiven);
    input.motion->image = i;
    input.motion->is_keyframe = i % 5 == 0;
    return input;
  }
  void MakeMap(int images) {
    for (int i = 0; i < images; ++i) slam_.Process(InputAt(i));
    slam_.Finish();
    slam_.SetMapping(false);
  }

  const synthetic::World world_ = synthetic::MakeWorld({});
  Rng rng_{7};
  Slam slam_{OfflineIn(), world_.camera};
};

TEST_F(GivenInputTest, AMapIsMadeAndFollowedWithoutAnImage) {
  MakeMap(60);
  ASSERT_GT(slam_.Snapshot().Landmarks().size(), 50u);
  std::optional<double> unit;
  const TrackingResult first = slam_.Process(InputAt(60));
  ASSERT_TRUE(first.HasPose());
  const Rigid3 start = *first.PoseIn(first.world);
  for (int i = 75; i <= 90; i += 15) {  // two images a second
    const TrackingResult result = slam_.Process(InputAt(i));
    ASSERT_EQ(result.state, TrackingState::kTracking);
    unit = result.motion_unit;
    ASSERT_TRUE(unit);
    // The way since the first, in the odometry's unit.
    const double way = (result.PoseIn(result.world)->translation - start.translation).norm();
    const double truth = CenterDistance(CamFromWorld(i), CamFromWorld(60));
    EXPECT_NEAR(way / *unit, truth / kUnitGiven, 0.03 * truth / kUnitGiven);
  }
  EXPECT_NEAR(*unit, 1, 0.1);  // the map was begun in the odometry's unit
}

TEST_F(GivenInputTest, WhereTheMotionIsNotKnownTheMapIsFollowedWithoutIt) {
  MakeMap(60);
  ImageInput input = InputAt(60);
  input.motion->is_known = false;
  const TrackingResult result = slam_.Process(input);
  EXPECT_EQ(result.state, TrackingState::kTracking);
  EXPECT_FALSE(result.motion_unit);
}

// Background that is matched about the last pose could place the camera there, however far it has
// moved.
TEST_F(GivenInputTest, WhereNothingTellsTheWayAnImageThatComesLaterIsFoundAnew) {
  MakeMap(60);
  for (const int i : {60, 75, 90}) {
    ImageInput input = InputAt(i);
    input.motion->is_preliminary = true;
    const TrackingResult result = slam_.Process(input);
    EXPECT_EQ(result.state, i > 60 ? TrackingState::kRelocalized : TrackingState::kTracking);
  }
}

TEST_F(GivenInputTest, ASingleImageIsFoundByItsKeyPoints) {
  MakeMap(60);
  ImageInput input;
  input.features = FeaturesAt(30, world_);
  EXPECT_TRUE(slam_.Relocalize(input).world_from_cam);
  input.features->features.clear();
  EXPECT_FALSE(slam_.Relocalize(input).world_from_cam);
}

// An odometry of inverse depths lets noise place what is far away beyond infinity.
TEST_F(GivenInputTest, APointBeyondInfinityIsNone) {
  MakeMap(60);
  ImageInput input = InputAt(60);
  input.motion->depths.push_back({{100, 100}, -0.001});
  input.motion->depths.push_back({{200, 100}, 0});
  EXPECT_EQ(slam_.Process(input).state, TrackingState::kTracking);
}

TEST_F(GivenInputTest, IsChecked) {
  const auto refused = [&](auto change) {
    ImageInput input = InputAt(0);
    change(input);
    slam_.Process(input);
  };
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.features.reset(); }), HasSubstr("0x0"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.features->levels = 17; }),
                     HasSubstrs("levels: 17", "1 to 16"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.features->factor = 1; }), HasSubstr("factor"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.features->lowest_pixel = NAN; }),
                     HasSubstr("lowest pixel"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.features->features[3].level = 8; }),
                     HasSubstrs("feature 3", "level: 8"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.features->features[3].angle_rad = 7; }),
                     HasSubstr("angle"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.features->features[3].pixel.x() = NAN; }),
                     HasSubstr("pixel"));
  EXPECT_INPUT_ERROR(
      refused([](ImageInput& in) { in.motion->odom_from_cam.rotation.coeffs() *= 2; }),
      HasSubstr("unit quaternion"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.motion->run = -1; }), HasSubstr("run: -1"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.motion->agreeing = 2; }),
                     HasSubstr("agreeing"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) { in.motion->depths[1].inverse_depth = NAN; }),
                     HasSubstr("depth 1"));
  EXPECT_INPUT_ERROR(refused([](ImageInput& in) {
                       in.motion->corrected = {{2, {}}, {2, {}}};
                     }),
                     HasSubstr("image 2"));
  EXPECT_NO_THROW(refused([](ImageInput&) {}));
}

// A camera that loses one map, begins another, and sees both again.
class WorldsTest : public GivenInputTest {
 protected:
  // Processes the next image. The motion of each `walk` has a frame and a unit of its own.
  TrackingResult Process(int place, const synthetic::World& seen, int walk) {
    ImageInput input;
    input.timestamp = images_ / 30.0;
    input.features = FeaturesAt(place, seen);
    input.motion = MotionSince(40 * walk, place, seen, 1 + 0.5 * walk);
    input.motion->run = walk;
    input.motion->image = images_++;
    input.motion->is_keyframe = images_ % 5 == 0;
    return slam_.Process(input);
  }

  const synthetic::World all_ = synthetic::MakeWorld({.points = 1200});
  const std::array<synthetic::World, 2> halves_ = HalvesOf(all_);
  int images_ = 0;
};

TEST_F(WorldsTest, ACameraThatIsLostHasAPoseInTheMapThatBegins) {
  TrackingResult last;
  for (int i = 0; i < 60; ++i) last = Process(i, halves_[0], 0);
  const WorldId first = last.world;
  ASSERT_TRUE(last.PoseIn(first));
  EXPECT_TRUE(last.elsewhere.empty());
  for (int i = 58; i >= 30; --i) last = Process(i, halves_[0], 0);
  const std::optional<Rigid3> at_30 = last.PoseIn(first);
  ASSERT_TRUE(at_30);

  WorldId second;
  int images_in_second = 0;
  for (int i = 0; i < 150; ++i) {
    last = Process(i % 100 < 50 ? 31 + i % 50 : 80 - i % 50, halves_[1], 1);
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

  for (int i = 81; i >= 30; --i) Process(i, all_, 2);
  slam_.Finish();
  last = Process(30, all_, 2);
  ASSERT_EQ(last.world, second);
  ASSERT_TRUE(last.PoseIn(second));
  EXPECT_FALSE(last.PoseIn(WorldId(second.value + 1000)));
  const std::optional<Rigid3> found = last.PoseIn(first);
  ASSERT_TRUE(found);
  EXPECT_LT((found->translation - at_30->translation).norm(), 0.1);
  EXPECT_LT(found->rotation.angularDistance(at_30->rotation), 0.02);
  ASSERT_EQ(last.elsewhere.size(), 1u);
  EXPECT_NEAR(last.elsewhere[0].covariance(0, 0) / last.covariance(0, 0), 1.5 * 1.5, 0.3);
}

}  // namespace
}  // namespace oaslam
