#include <gtest/gtest.h>

#include <algorithm>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/system/atlas.h"
#include "offline_config.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr double kUnit = 0.4;  // of the odometry, in units of the world

struct Walk {
  int frames = 90;
  int blind_from = 45, blind_to = 60;  // nothing of the map is seen there
  int preliminary_to = 5;
  int cut_at = 1000;         // another run of the odometry begins
  int unmapped_from = 1000;  // mapping ends there
  // The odometry's poses from here on are wrong, until it corrects them.
  int wrong_from = 1000, wrong_to = 1000;
  bool saves_features = false;  // features are taken only where the tracker needs them
};

struct Walked {
  std::vector<ImagePose> poses;
  std::vector<Rigid3> truth;  // cam_from_odom
  std::shared_ptr<const Map> map;
  int without_features = 0;  // images
  std::vector<FramePose> trajectory;
};

// A camera on an arc whose images are empty for a while; the odometry goes on.
Walked Follow(const Walk& walk) {
  const synthetic::World world = synthetic::MakeWorld({});
  Atlas atlas(OfflineIn(), synthetic::EmptyMap(), false, {});
  Walked walked;
  Rng rng(7);
  const Rigid3 first = synthetic::PoseOnArc({}, -20);
  for (int i = 0; i < walk.frames; ++i) {
    const Rigid3 pose = synthetic::PoseOnArc({}, -20 + 0.4 * i);
    const bool is_blind = i >= walk.blind_from && i < walk.blind_to;
    Frame frame =
        MakeFrame(synthetic::MakeView(world, pose, {.missed = is_blind ? 1.0 : 0.1}, rng), i);
    FrameMotion motion;
    motion.run = i >= walk.cut_at;
    motion.image = i;
    walked.truth.push_back(pose * first.Inverse());
    walked.truth.back().translation /= kUnit;
    const auto known = [&](int image) {
      constexpr double kAway = 0.05;  // an image
      Rigid3 then = walked.truth[image];
      if (i < walk.wrong_to) then.translation.x() += kAway * std::max(0, image - walk.wrong_from);
      return then;
    };
    motion.cam_from_odom = known(i);
    for (int k = 0; k <= i; k += 5) motion.keyframes.emplace_back(k, known(k));
    motion.is_preliminary = i < walk.preliminary_to;
    motion.is_keyframe = i % 5 == 0;
    motion.depths = DepthsFrom(world, pose, kUnit);
    if (walk.saves_features && !atlas.NeedsFeatures(frame.timestamp, nullptr) &&
        !atlas.NeedsFeatures(frame.timestamp, &motion)) {
      frame.features = std::make_shared<const Features>(frame.features->Selected({}));
      frame.features_skipped = true;
      ++walked.without_features;
    }
    frame.motion = std::make_shared<const FrameMotion>(std::move(motion));
    if (i == walk.unmapped_from) atlas.SetMapping(false);
    walked.poses.push_back(atlas.Process(frame).pose);
  }
  atlas.Finish();
  walked.map = atlas.main().snapshot();
  walked.trajectory = atlas.main().tracker().trajectory();
  return walked;
}

double ErrorAt(const Walked& walked, int frame) {
  const auto& pose = walked.poses[frame].cam_from_world;
  return pose ? CenterDistance(*pose, walked.truth[frame]) : 1e9;
}

// Of a pose in the trajectory, in the end; huge where its reference is gone.
double FinalErrorOf(const Walked& walked, const FramePose& pose) {
  const auto reference = walked.map->ResolvePose(pose.reference);
  return reference
             ? CenterDistance(pose.cam_from_reference * *reference, walked.truth[pose.frame_index])
             : 1e9;
}

TEST(OdometryTracking, EveryImageHasAPose) {
  const Walked walked = Follow({});
  for (int i = 0; i < 90; ++i) {
    const TrackingState state = walked.poses[i].state;
    EXPECT_TRUE(walked.poses[i].cam_from_world.has_value()) << i;
    if (i < 5) {
      EXPECT_EQ(state, TrackingState::kPreliminary) << i;
    }
    if (i >= 45 && i < 60) {
      EXPECT_EQ(state, TrackingState::kOdometry) << i;
    }
    // The map has the frame and the unit of the odometry; the depth is 7 of these.
    EXPECT_LT(ErrorAt(walked, i), 0.1) << i << " " << ToString(state);
  }
  EXPECT_EQ(walked.poses[65].state, TrackingState::kTracking);
}

// What is not seen in the map has a pose by the way since, so that keyframes go on, each tied to
// the one before.
TEST(OdometryTracking, KeyframesGoOnWithoutLandmarks) {
  const Walked walked = Follow({.frames = 75, .blind_from = 45, .blind_to = 75});
  int blind = 0;
  walked.map->keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.frame_index < 46) return;
    ++blind;
    ASSERT_TRUE(keyframe.motion.has_value());
    EXPECT_GT(keyframe.motion->sigma_position, 0);
    EXPECT_LT(CenterDistance(keyframe.cam_from_world, walked.truth[keyframe.frame_index]), 0.1);
  });
  EXPECT_GE(blind, 3);
  EXPECT_TRUE(walked.map->CheckInvariants().empty());
}

// The odometry goes on optimising its keyframes: what it corrects reaches the map's.
TEST(OdometryTracking, CorrectionsOfTheMotionReachTheMap) {
  const Walked walked =
      Follow({.frames = 75, .blind_from = 45, .blind_to = 75, .wrong_from = 45, .wrong_to = 65});
  EXPECT_GT(ErrorAt(walked, 60), 0.5);
  walked.map->keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    EXPECT_LT(CenterDistance(keyframe.cam_from_world, walked.truth[keyframe.frame_index]), 0.1)
        << keyframe.frame_index;
  });
}

// Images between those in which the map is looked for have their pose by the motion alone.
TEST(OdometryTracking, FeaturesAreNotTakenFromEachImage) {
  const Walked walked =
      Follow({.frames = 120, .blind_from = 200, .blind_to = 200, .saves_features = true});
  EXPECT_GT(walked.without_features, 10);
  for (int i = 15; i < 120; ++i) {
    EXPECT_EQ(walked.poses[i].state, TrackingState::kTracking) << i;
    EXPECT_LT(ErrorAt(walked, i), 0.1) << i;
  }
  ASSERT_EQ(walked.trajectory.size(), 120);
  for (const FramePose& pose : walked.trajectory)
    EXPECT_LT(FinalErrorOf(walked, pose), 0.1) << pose.frame_index;
}

// Without mapping the map is looked for, and for seconds the images before tell where the
// odometry's frame lies in it.
TEST(OdometryTracking, WithoutMappingTheMotionCarriesThePoseOn) {
  const Walked before = Follow({.frames = 45, .blind_from = 200, .blind_to = 200});
  const Walked walked =
      Follow({.frames = 260, .blind_from = 60, .blind_to = 260, .unmapped_from = 45});
  for (int i = 45; i < 260; ++i) EXPECT_LT(ErrorAt(walked, i), 0.1) << i;
  EXPECT_EQ(walked.poses[250].state, TrackingState::kObjects);
  EXPECT_EQ(walked.trajectory.size(), 260);
  EXPECT_EQ(walked.map->keyframes.size(), before.map->keyframes.size());
  EXPECT_EQ(walked.map->landmarks.size(), before.map->landmarks.size());
}

// Poses of different runs have nothing in common: without landmarks the camera is lost.
TEST(OdometryTracking, ACutLosesTheCamera) {
  const Walked walked = Follow({.frames = 60, .blind_from = 45, .blind_to = 60, .cut_at = 45});
  EXPECT_EQ(walked.poses[44].state, TrackingState::kTracking);
  EXPECT_EQ(walked.poses[50].state, TrackingState::kLost);
  EXPECT_FALSE(walked.poses[50].cam_from_world.has_value());
}

// The images in which it was lost get their poses by the motion to where it was found again.
TEST(OdometryTracking, LostImagesArePlacedOnceTheCameraIsFound) {
  const Walked walked = Follow({.frames = 100, .blind_from = 45, .blind_to = 60, .cut_at = 45});
  EXPECT_EQ(walked.poses[50].state, TrackingState::kLost);
  EXPECT_EQ(walked.poses.back().state, TrackingState::kTracking);
  ASSERT_EQ(walked.trajectory.size(), 100);
  for (const FramePose& pose : walked.trajectory)
    EXPECT_LT(FinalErrorOf(walked, pose), 0.1) << pose.frame_index;
}

}  // namespace
}  // namespace oaslam
