#include "oaslam/tracking/odometry_link.h"

#include <gtest/gtest.h>

#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr double kUnit = 0.4;  // of the odometry, in units of the map

// A map of the synthetic world, and images whose odometry has a unit of its own.
class OdometryLinkTest : public testing::Test {
 protected:
  static Rigid3 PoseAt(int image) { return synthetic::PoseOnArc({}, -20 + 0.4 * image); }

  FrameMotion MotionAt(int image) const {
    FrameMotion motion;
    motion.image = image;
    motion.cam_from_odom = PoseAt(image);
    motion.cam_from_odom.translation /= kUnit;
    motion.depths = DepthsFrom(world_, PoseAt(image), kUnit);
    return motion;
  }

  static Frame FrameWith(const FrameMotion& motion) {
    Frame frame;
    frame.index = motion.image;
    frame.timestamp = motion.image / 30.0;
    frame.motion = std::make_shared<const FrameMotion>(motion);
    return frame;
  }

  // An image with its true pose and landmarks, relative to the first keyframe.
  TrackedFrame SeenAt(int image) {
    const synthetic::View view = synthetic::MakeView(world_, PoseAt(image), {}, rng_);
    TrackedFrame seen{{PoseAt(image), kFirst}, FrameWith(MotionAt(image)), {}};
    seen.frame.camera = view.camera;
    seen.frame.features = view.features;
    seen.cam_from_reference =
        PoseAt(image) * mapped_.map.keyframes.At(kFirst).cam_from_world.Inverse();
    seen.landmarks = mapped_.LandmarksIn(view);
    return seen;
  }

  double ErrorOf(const OdometryPrediction& predicted, int image) const {
    return CenterDistance(predicted.expected.cam_from_world, PoseAt(image));
  }

  static constexpr KeyframeId kFirst{0};
  synthetic::World world_ = synthetic::MakeWorld({});
  synthetic::MappedWorld mapped_ = synthetic::MakeMap(world_, {});
  Rng rng_{3};
  OdometryLink link_;
};

TEST_F(OdometryLinkTest, LearnsTheUnitFromPointsThatBothKnow) {
  EXPECT_FALSE(link_.UnitFor(FrameWith(MotionAt(0))));
  link_.See(SeenAt(0), 3, mapped_.map, nullptr);
  const auto unit = link_.UnitFor(FrameWith(MotionAt(1)));
  ASSERT_TRUE(unit);
  EXPECT_NEAR(*unit, kUnit, 0.02 * kUnit);
  FrameMotion other_run = MotionAt(1);
  other_run.run = 1;
  EXPECT_FALSE(link_.UnitFor(FrameWith(other_run)));
}

TEST_F(OdometryLinkTest, AMetricOdometryTellsTheMapsMetre) {
  constexpr double kMetres = 1.5;  // of a unit of the odometry
  const auto seen_at = [&](int image, double longer) {
    TrackedFrame seen = SeenAt(image);
    FrameMotion motion = *seen.frame.motion;
    motion.metre = MeasuredMetre{kMetres / longer, 0.02, UnitSource::kImu};
    seen.frame = FrameWith(motion);
    seen.frame.camera = SeenAt(image).frame.camera;
    seen.frame.features = SeenAt(image).frame.features;
    return seen;
  };
  EXPECT_FALSE(link_.metre());
  TrackedFrame last = seen_at(0, 1);
  link_.See(last, 3, mapped_.map, nullptr);
  for (int image = 1; image < 30; ++image) {
    const TrackedFrame next = seen_at(image, 1);
    link_.See(next, 3, mapped_.map, &last);
    last = next;
  }
  ASSERT_TRUE(link_.metre());
  EXPECT_NEAR(link_.metre()->metres_per_unit, kMetres / kUnit, 0.05 * kMetres / kUnit);
  EXPECT_EQ(link_.metre()->relative_sigma, 0.02);
  // The odometry's unit has shrunk to half, as its IMU tells; the points say otherwise.
  const TrackedFrame shrunk = seen_at(30, 2);
  link_.See(shrunk, 3, mapped_.map, &last);
  EXPECT_NEAR(*link_.UnitFor(shrunk.frame), kUnit / 2, 0.1 * kUnit);
  link_.Scale(10);
  EXPECT_NEAR(link_.metre()->metres_per_unit, 0.1 * kMetres / kUnit, 0.006 * kMetres / kUnit);
}

TEST_F(OdometryLinkTest, PredictsByTheMotionSinceTheMapWasSeen) {
  link_.See(SeenAt(0), 3, mapped_.map, nullptr);
  const auto soon = link_.Predict(FrameWith(MotionAt(3)), mapped_.map, MapUse::kExtend);
  const auto later = link_.Predict(FrameWith(MotionAt(30)), mapped_.map, MapUse::kExtend);
  ASSERT_TRUE(soon && later);
  EXPECT_FALSE(soon->is_turn);
  EXPECT_LT(ErrorOf(*soon, 3), 0.01);
  EXPECT_LT(ErrorOf(*later, 30), 0.1);
  EXPECT_LT(soon->expected.sigma_position, later->expected.sigma_position);
  EXPECT_LT(ErrorOf(*later, 30), 3 * later->expected.sigma_position);
}

TEST_F(OdometryLinkTest, FollowsAChangeOfTheMapsUnit) {
  link_.See(SeenAt(0), 3, mapped_.map, nullptr);
  const auto before = link_.Predict(FrameWith(MotionAt(9)), mapped_.map, MapUse::kExtend);
  mapped_.map.Scale(5);
  link_.Scale(5);
  const auto after = link_.Predict(FrameWith(MotionAt(9)), mapped_.map, MapUse::kExtend);
  ASSERT_TRUE(before && after);
  EXPECT_LT(
      (after->expected.cam_from_world.translation - 5 * before->expected.cam_from_world.translation)
          .norm(),
      1e-9);
  EXPECT_NEAR(after->expected.sigma_position, 5 * before->expected.sigma_position, 1e-9);
  EXPECT_NEAR(after->depth, 5 * before->depth, 1e-9);
}

// Of a motion whose way is not known the turn counts, for a second.
TEST_F(OdometryLinkTest, TrustsATurnForASecond) {
  link_.See(SeenAt(0), 3, mapped_.map, nullptr);
  FrameMotion turn = MotionAt(5);
  turn.is_preliminary = true;
  const auto predicted = link_.Predict(FrameWith(turn), mapped_.map, MapUse::kExtend);
  ASSERT_TRUE(predicted);
  EXPECT_TRUE(predicted->is_turn);
  EXPECT_GE(predicted->expected.sigma_position, kUnknownWay * 3);
  turn.image = 45;
  EXPECT_FALSE(link_.Predict(FrameWith(turn), mapped_.map, MapUse::kExtend));
}

TEST_F(OdometryLinkTest, EndsWithTheRunOrWhereNothingCorrectsIt) {
  link_.See(SeenAt(0), 3, mapped_.map, nullptr);
  FrameMotion other_run = MotionAt(3);
  other_run.run = 1;
  EXPECT_FALSE(link_.Predict(FrameWith(other_run), mapped_.map, MapUse::kExtend));
  EXPECT_FALSE(link_.Predict({}, mapped_.map, MapUse::kExtend));
  FrameMotion late = MotionAt(3);
  late.image = 160;
  EXPECT_TRUE(link_.Predict(FrameWith(late), mapped_.map, MapUse::kExtend));
  EXPECT_FALSE(link_.Predict(FrameWith(late), mapped_.map, MapUse::kRead));
}

// The odometry's corrections of earlier keyframes are sent with the motion to the newest one.
TEST_F(OdometryLinkTest, SendsMotionsAsTheOdometryKnowsThemByNow) {
  link_.See(SeenAt(0), 3, mapped_.map, nullptr);
  std::vector<FrameMotion> motions;
  for (const int image : {0, 5, 10}) {
    motions.push_back(MotionAt(image));
    for (const FrameMotion& known : motions)
      motions.back().keyframes.emplace_back(known.image, known.cam_from_odom);
    link_.AddKeyframe(KeyframeId(static_cast<uint32_t>(image)), FrameWith(motions.back()));
  }
  FrameMotion corrected = motions.back();
  corrected.image = 11;
  corrected.keyframes[1].second.translation.x() += 0.5;
  const auto sent = link_.MotionsToKeyframes(FrameWith(corrected));
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_EQ(sent[0].first, KeyframeId(5));
  EXPECT_EQ(sent[0].second.from, KeyframeId(0));
  const Rigid3 before = motions[1].cam_from_odom * motions[0].cam_from_odom.Inverse();
  const auto unit = link_.UnitFor(FrameWith(corrected));
  ASSERT_TRUE(unit);
  EXPECT_NEAR((sent[0].second.cam_from_cam.translation - *unit * before.translation).norm(),
              *unit * 0.5, 1e-9);
}

// An image may go without features where the motion is sure, once the map is two seconds old.
TEST_F(OdometryLinkTest, CarriesImagesOnceTheMapHasAnAge) {
  link_.Begin(FrameWith(MotionAt(0)), kFirst, 3);
  FrameMotion motion = MotionAt(1);
  EXPECT_FALSE(link_.CanCarry(1, &motion, MapUse::kRead));
  EXPECT_TRUE(link_.CanCarry(3, nullptr, MapUse::kRead));
  EXPECT_TRUE(link_.CanCarry(3, &motion, MapUse::kRead));
  // In a map that is only read it is looked for again before the pose is given up.
  EXPECT_FALSE(link_.CanCarry(6, &motion, MapUse::kRead));
  EXPECT_TRUE(link_.CanCarry(6, &motion, MapUse::kExtend));
  motion.is_keyframe = true;
  EXPECT_FALSE(link_.CanCarry(3, &motion, MapUse::kRead));
  motion.is_keyframe = false;
  motion.run = 1;
  EXPECT_FALSE(link_.CanCarry(3, &motion, MapUse::kRead));
}

}  // namespace
}  // namespace oaslam
