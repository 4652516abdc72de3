#include <gtest/gtest.h>

#include "matchers.h"
#include "oaslam/mapping/background_bundle.h"
#include "oaslam/system/atlas.h"
#include "oaslam/system/map_pipeline.h"
#include "offline_config.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

using synthetic::EmptyMap;

// A map needs the odometry to begin; then the camera is followed by its landmarks alone.
constexpr int kBeginning = 30;

struct WalkResult {
  std::vector<FramePose> trajectory;
  std::vector<Rigid3> final_poses;  // cam_from_world, of trajectory
  std::shared_ptr<const Map> map;
  std::vector<TrackingState> states;
};

// The camera walks along the arc of the synthetic world and back, 0.4 degrees a frame.
Rigid3 PoseOf(int frame) {
  return synthetic::PoseOnArc({}, -20 + 0.4 * (frame < 80 ? frame : 160 - frame));
}

// The camera sees nothing in [blind_from, blind_to). With a slow camera the mapper has all the time
// it needs.
WalkResult RunWalk(RunnerMode mode, int frames, int blind_from = -1, int blind_to = -1,
                   bool slow_camera = false) {
  const synthetic::World world = synthetic::MakeWorld({.farthest = 3.6});
  Atlas atlas(OfflineIn(mode), EmptyMap(), false, {});
  WalkResult run;
  Rng rng(7);
  for (int i = 0; i < frames; ++i) {
    const bool blind = i >= blind_from && i < blind_to;
    Frame frame =
        MakeFrame(synthetic::MakeView(world, PoseOf(i), {.missed = blind ? 1.0 : 0.1}, rng), i);
    if (!blind && i < kBeginning + std::max(0, blind_to))
      frame.motion = synthetic::TrueMotion(i, PoseOf(i), i >= blind_to);
    run.states.push_back(atlas.Process(frame).pose.state);
    if (slow_camera) atlas.main().Newest();
  }
  atlas.Finish();
  run.map = atlas.main().snapshot();
  run.trajectory = atlas.main().tracker().trajectory();
  for (const FramePose& f : run.trajectory)
    run.final_poses.push_back(f.cam_from_reference * *run.map->ResolvePose(f.reference));
  return run;
}

// RMSE of camera centres against the arc, in units of the world.
double AbsoluteError(const WalkResult& run) {
  std::vector<Rigid3> truth;
  for (const FramePose& pose : run.trajectory) truth.push_back(PoseOf(pose.frame_index));
  return CenterErrorsOf(run.final_poses, truth, true).rms;
}

TEST(Pipeline, TracksAWalkAccuratelyInEveryMode) {
  for (const RunnerMode mode :
       {RunnerMode::kSequential, RunnerMode::kLockstep, RunnerMode::kLive}) {
    const WalkResult run = RunWalk(mode, 120, -1, -1, mode == RunnerMode::kLive);
    EXPECT_GT(run.trajectory.size(), 95U) << ToString(mode);
    EXPECT_LT(AbsoluteError(run), 0.01) << ToString(mode);
    EXPECT_GE(run.map->keyframes.size(), 4U) << ToString(mode);
    EXPECT_THAT(run.map->CheckInvariants(), IsEmpty()) << ToString(mode);
  }
}

TEST(Pipeline, LockstepAndSequentialRunsRepeatExactly) {
  for (const RunnerMode mode : {RunnerMode::kSequential, RunnerMode::kLockstep}) {
    const WalkResult a = RunWalk(mode, 90), b = RunWalk(mode, 90);
    ASSERT_GT(a.final_poses.size(), 60U);
    ASSERT_EQ(a.final_poses.size(), b.final_poses.size());
    for (size_t i = 0; i < a.final_poses.size(); ++i) {
      EXPECT_EQ(a.final_poses[i].translation, b.final_poses[i].translation);
      EXPECT_EQ(a.final_poses[i].rotation.coeffs(), b.final_poses[i].rotation.coeffs());
    }
    EXPECT_EQ(a.map->landmarks.size(), b.map->landmarks.size());
  }
}

// Which frames are tracked depends on the load of the machine; the map must be
// consistent in any case.
TEST(Pipeline, ACameraFasterThanTheMapperLeavesTheMapConsistent) {
  const WalkResult run = RunWalk(RunnerMode::kLive, 120);
  EXPECT_GE(run.map->keyframes.size(), 2U);
  EXPECT_GE(run.map->landmarks.size(), 100U);
  EXPECT_THAT(run.map->CheckInvariants(), IsEmpty());
  ASSERT_GE(run.trajectory.size(), 3U);
  EXPECT_LT(AbsoluteError(run), 0.05);
}

TEST(Pipeline, ItsQueueIsBounded) {
  MapPipeline pipeline(OfflineIn(RunnerMode::kLive), EmptyMap());
  MapCommand nothing;
  for (nothing.frame_index = 0; nothing.frame_index < 200; ++nothing.frame_index) {
    pipeline.Submit(nothing);
    // The mapper may be at work on one more.
    EXPECT_GE(pipeline.SnapshotFor(nothing.frame_index + 1)->version + MapPipeline::kMaxQueued,
              static_cast<uint64_t>(nothing.frame_index + 1));
  }
  EXPECT_EQ(pipeline.Newest()->version, 201U);
}

TEST(Pipeline, MayEndAtAnyMoment) {
  synthetic::World world = synthetic::MakeWorld({});
  for (const RunnerMode mode :
       {RunnerMode::kSequential, RunnerMode::kLockstep, RunnerMode::kLive}) {
    for (const int end : {0, 1, 5, 9, 10, 11, 12, 13, 14, 25, 40}) {
      Session session(OfflineIn(mode), EmptyMap(), false);
      uint32_t next_keyframe = 0, next_object = 0;
      Rng rng(7);
      for (int i = 0; i < end; ++i)
        session.Process(MakeFrame(synthetic::MakeView(world, PoseOf(2 * i), {}, rng), i),
                        {.next_keyframe = &next_keyframe, .next_object = &next_object});
      if (end % 2 == 0) {
        EXPECT_THAT(session.Newest()->CheckInvariants(), IsEmpty());
      }  // else it ends with commands in the queue
    }
  }
}

TEST(BackgroundBundle, EndsWithItsOwnerAndCorrectsWhatHasGrown) {
  const synthetic::World world = synthetic::MakeWorld({});
  Map map = synthetic::MakeMap(world, {.position_noise = 0.03}).map;
  { const BackgroundBundle stopped(map, map.keyframes.Ids(), BundleConfig{}, 0); }
  BackgroundBundle bundle(map, map.keyframes.Ids(), BundleConfig{}, 3);
  EXPECT_EQ(bundle.begun_at(), 3);
  map.RetireKeyframe(KeyframeId(4));
  const Map before = map;
  bundle.WaitAndApply(map);
  EXPECT_TRUE(bundle.IsReady());
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  double moved = 0;
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& l) {
    moved = std::max(moved, (l.position - before.landmarks.At(id).position).norm());
  });
  EXPECT_GT(moved, 0.01);
}

TEST(Pipeline, LostEarlyItStartsAnew) {
  const WalkResult run = RunWalk(RunnerMode::kLockstep, 70, 16, 22);
  EXPECT_EQ(run.states[18], TrackingState::kInitializing);
  EXPECT_EQ(run.states.back(), TrackingState::kTracking);
  EXPECT_LT(AbsoluteError(run), 0.02);
}

TEST(Pipeline, LostWithARealMapItComesBackToIt) {
  const WalkResult run = RunWalk(RunnerMode::kLockstep, 160, 100, 106);
  EXPECT_EQ(run.states[103], TrackingState::kLost);
  EXPECT_EQ(run.states.back(), TrackingState::kTracking);
  EXPECT_GT(run.trajectory.size(), 135U);
  EXPECT_LT(AbsoluteError(run), 0.01);
}

}  // namespace
}  // namespace oaslam
