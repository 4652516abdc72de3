#include "oaslam/tracking/tracker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "oaslam/mapping/mapper.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

// A tracker and the mapper that makes its map, one after the other.
class TrackerTest : public testing::Test {
 protected:
  TrackerTest() { Publish(); }

  // A map needs the odometry to begin; then the camera is followed by its landmarks alone.
  static constexpr int kBeginning = 30;

  // What frame `index` shows from a place on the arc of the synthetic world (degrees).
  Frame View(int index, double angle, double missed = 0.1) {
    const Rigid3 pose = synthetic::PoseOnArc({}, angle);
    Frame frame = MakeFrame(synthetic::MakeView(world_, pose, {.missed = missed}, rng_), index);
    if (index < kBeginning) frame.motion = synthetic::TrueMotion(index, pose);
    return frame;
  }

  ImagePose Track(const Frame& frame) {
    TrackingStep step = tracker_.Track(frame, *map_, context_);
    if (step.command) {
      mapper_.Apply(*step.command);
      Publish();
    }
    return (tracker_.AwaitsMap() ? tracker_.Begin(frame, *map_) : step).pose;
  }

  void Publish() { map_ = mapper_.Publish(); }

  synthetic::World world_ = synthetic::MakeWorld({});
  Rng rng_{7};
  uint32_t next_keyframe_ = 0, next_object_ = 0;
  TrackingContext context_{.next_keyframe = &next_keyframe_, .next_object = &next_object_};
  Mapper mapper_{SlamConfig::Offline(), synthetic::EmptyMap()};
  Tracker tracker_{SlamConfig::Offline(), false};
  std::shared_ptr<const Map> map_;
};

// A viewer shows what the tracker made of an image, and after a forced relocalization the camera is
// found where it was.
TEST_F(TrackerTest, ShowsItsFrameAndRelocalizesWhenTold) {
  ImagePose pose;
  for (int i = 0; i < 60; ++i) {
    if (i == 50) tracker_.ForceRelocalization(std::nullopt);
    pose = Track(View(i, -20 + 0.4 * i));
    const FrameView view = tracker_.View();
    EXPECT_EQ(view.frame.index, i);
    EXPECT_EQ(view.pose.has_value(),
              pose.cam_from_world.has_value() && pose.state != TrackingState::kPreliminary);
    EXPECT_EQ(view.relocalization.has_value(), i == 50);
    if (i == 50) {
      EXPECT_EQ(pose.state, TrackingState::kRelocalized);
      EXPECT_EQ(view.relocalization->evidence, PoseEvidence::kPoints);
    }
    if (pose.state != TrackingState::kTracking) continue;
    EXPECT_EQ(pose.source, PoseSource::kMap);
    EXPECT_EQ(static_cast<int>(view.landmarks.size()), view.frame.features->size());
    EXPECT_GE(std::ranges::count_if(view.landmarks, [](LandmarkId id) { return id.IsValid(); }),
              pose.inliers);
  }
  EXPECT_EQ(pose.state, TrackingState::kTracking);
}

// After a change of the unit all that is said of a pose has the new unit.
TEST_F(TrackerTest, ScalesThePoseAndItsCovariance) {
  for (int i = 0; i < 50; ++i) Track(View(i, -20 + 0.4 * i));
  Map map = *map_;
  const ImagePose before = tracker_.Present(map);
  constexpr double kFactor = 3;
  map.Scale(kFactor);
  tracker_.Scale(kFactor);
  const ImagePose after = tracker_.Present(map);
  ASSERT_TRUE(before.cam_from_world && after.cam_from_world);
  EXPECT_LT(
      (after.cam_from_world->translation - kFactor * before.cam_from_world->translation).norm(),
      1e-9);
  EXPECT_NEAR(SigmaOfPosition(after.covariance), kFactor * SigmaOfPosition(before.covariance),
              1e-9);
  EXPECT_NEAR(SigmaOfRotation(after.covariance), SigmaOfRotation(before.covariance), 1e-9);
  EXPECT_NEAR(after.confidence, before.confidence, 1e-9);
}

// What looks like a place that the camera cannot have reached is another one that looks alike.
class TrackerAfterACover : public TrackerTest {
 protected:
  // The states of a walk along an arc, covered for three images, after which the camera stands at
  // `angle` (degrees) and goes on.
  std::vector<TrackingState> StatesGoingOnAt(double angle) {
    std::vector<TrackingState> states;
    for (int i = 0; i < 90; ++i)
      states.push_back(
          Track(i < 63 ? View(i, -20 + 0.4 * i, i < 60 ? 0.1 : 1) : View(i, angle + 0.1 * (i - 63)))
              .state);
    return states;
  }
};

TEST_F(TrackerAfterACover, FindsTheCameraWhereItMayBe) {
  EXPECT_EQ(StatesGoingOnAt(5)[63], TrackingState::kRelocalized);
}

TEST_F(TrackerAfterACover, DoesNotBelieveThatTheCameraJumped) {
  const std::vector<TrackingState> jumped = StatesGoingOnAt(-18);
  EXPECT_EQ(jumped[63], TrackingState::kLost);
  EXPECT_EQ(jumped[66], TrackingState::kLost);
  EXPECT_EQ(jumped.back(), TrackingState::kTracking);
}

// The world has things on its left and a window on its right, which the camera sees together and
// then comes near to, so that it sees the window alone.
class TrackerBeforeAWindow : public TrackerTest {
 protected:
  TrackerBeforeAWindow() {
    for (size_t i = 0; i < world_.points.size(); ++i) {
      Eigen::Vector3d& point = world_.points[i];
      if (i % 4 == 0)
        point = {rng_.Uniform(0.6, 1.8), 0, rng_.Uniform(-0.6, 0.6)};
      else
        point.x() = rng_.Uniform(-2, -0.6);
    }
    for (int i = 0; i < 60; ++i) Track(View(i, -20 + 0.4 * i));
  }

  // The camera sees nothing, and then, some seconds after it was seen last, the window.
  ImagePose BeforeIt(double seconds) {
    Track(View(60, 4, 1));
    Frame frame = View(61, 4);
    frame.features = synthetic::MakeView(world_, kBeforeIt, {}, rng_).features;
    frame.timestamp = 59 / 30.0 + seconds;
    return Track(frame);
  }

  const Rigid3 kBeforeIt = synthetic::LookAt({1.2, -1.5, 0.1}, {1.2, 0, 0});
};

TEST_F(TrackerBeforeAWindow, BelievesItSoonAfterTheCameraWasSeenThere) {
  EXPECT_EQ(BeforeIt(1).state, TrackingState::kRelocalized);
}

TEST_F(TrackerBeforeAWindow, DoesNotBelieveItLaterUntilMoreIsSeen) {
  EXPECT_EQ(BeforeIt(10).state, TrackingState::kLost);
  EXPECT_EQ(tracker_.View().relocalization->evidence, PoseEvidence::kNone);
  EXPECT_THAT(tracker_.View().relocalization->why_not, testing::HasSubstr("may hang elsewhere"));
  Frame whole = View(62, 4);
  whole.timestamp = 20;
  EXPECT_EQ(Track(whole).state, TrackingState::kRelocalized);
}

TEST_F(TrackerBeforeAWindow, DoesNotBelieveItWhereTheCameraMayHaveJumped) {
  tracker_.ForceRelocalization(std::nullopt);
  EXPECT_EQ(BeforeIt(1).state, TrackingState::kLost);
}

TEST_F(TrackerBeforeAWindow, BelievesTheUserWhereItIs) {
  tracker_.ForceRelocalization(kBeforeIt.Inverse());
  EXPECT_EQ(BeforeIt(10).state, TrackingState::kRelocalized);
}

// A camera that is lost in a map of few keyframes is not looked for there: another map begins.
TEST_F(TrackerTest, GivesUpASmallMapUnlessItIsWanted) {
  for (int i = 0; i < kBeginning; ++i) Track(View(i, -20 + 0.4 * i));
  ASSERT_LT(map_->keyframes.size(), 6U);
  Tracker wanted = tracker_;
  Map with_anchor = *map_;
  with_anchor.anchors["here"] = {};
  const Frame nothing = View(kBeginning, 0, 1);
  EXPECT_EQ(Track(nothing).state, TrackingState::kInitializing);
  EXPECT_TRUE(tracker_.HasGivenUp());
  EXPECT_EQ(wanted.Track(nothing, with_anchor, context_).pose.state, TrackingState::kLost);
  EXPECT_FALSE(wanted.HasGivenUp());
}

// A map that is only read, or is held while another one grows, gets no keyframes.
TEST_F(TrackerTest, AddsKeyframesOnlyWhereItMay) {
  for (int i = 0; i < 50; ++i) Track(View(i, -20 + 0.4 * i));
  const uint32_t keyframes = next_keyframe_;
  for (const MapUse use : {MapUse::kHold, MapUse::kRead}) {
    Tracker tracker = tracker_;
    for (int i = 50; i < 110; ++i) {
      const TrackingStep step = tracker.Track(
          View(i, -20 + 0.4 * i), *map_,
          {.use = use, .next_keyframe = &next_keyframe_, .next_object = &next_object_});
      EXPECT_FALSE(step.keyframe || step.command);
      EXPECT_EQ(step.located.has_value(),
                use == MapUse::kHold && step.pose.state == TrackingState::kTracking);
    }
    EXPECT_EQ(next_keyframe_, keyframes);
  }
  for (int i = 50; i < 110; ++i) Track(View(i, -20 + 0.4 * i));
  EXPECT_GT(next_keyframe_, keyframes);
}

}  // namespace
}  // namespace oaslam
