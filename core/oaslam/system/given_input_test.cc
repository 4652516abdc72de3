#include "expect_input_error.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/slam.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr double kUnitGiven = 0.4;  // of the application's odometry, in units of the world

// A camera on an arc, of which an application gives no images: only key points and the motion.
class GivenInputTest : public testing::Test {
 protected:
  static SlamConfig Config() {
    SlamConfig config = SlamConfig::Offline();
    config.runner.mode = RunnerMode::kSequential;
    return config;
  }
  static Rigid3 CamFromWorld(int i) { return synthetic::PoseOnArc({}, -20 + 0.4 * i); }

  // Of image i, as ImageInput has them.
  ImageFeatures FeaturesAt(int i) {
    const synthetic::View view =
        synthetic::MakeView(world_, CamFromWorld(i), {.missed = 0.1}, rng_);
    ImageFeatures given;
    given.lowest_pixel = view.features->pyramid.working_pixel();
    for (int k = 0; k < view.features->size(); ++k) {
      const Keypoint& point = view.features->keypoints[k];
      given.features.push_back(
          {point.px, point.angle_rad, point.octave, view.features->descriptors[k]});
    }
    return given;
  }
  MotionInput MotionAt(int i) const {
    MotionInput motion;
    motion.image = i;
    motion.odom_from_cam = CamFromWorld(0) * CamFromWorld(i).Inverse();
    motion.odom_from_cam.translation /= kUnitGiven;
    motion.is_keyframe = i % 5 == 0;
    for (const Eigen::Vector3d& point : world_.points) {
      const Eigen::Vector3d in_cam = CamFromWorld(i) * point;
      if (in_cam.z() > 0)
        motion.depths.push_back(
            {Distort(world_.camera, ProjectIdeal(world_.camera, in_cam)), kUnitGiven / in_cam.z()});
    }
    return motion;
  }
  ImageInput InputAt(int i) {
    ImageInput input;
    input.timestamp = i / 30.0;
    input.motion = MotionAt(i);
    input.features = FeaturesAt(i);
    return input;
  }
  void MakeMap(int images) {
    for (int i = 0; i < images; ++i) slam_.Process(InputAt(i));
    slam_.Finish();
    slam_.SetMapping(false);
  }

  const synthetic::World world_ = synthetic::MakeWorld({});
  Rng rng_{7};
  Slam slam_{Config(), world_.camera};
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
    const double truth =
        (CamFromWorld(i).OriginInSource() - CamFromWorld(60).OriginInSource()).norm();
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
  input.features = FeaturesAt(30);
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

}  // namespace
}  // namespace oaslam
