#include <gtest/gtest.h>

#include "matchers.h"
#include "oaslam/mapping/background_bundle.h"
#include "oaslam/system/atlas.h"
#include "oaslam/system/map_pipeline.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

Map EmptyMap() {
  Map empty;
  empty.cameras.push_back(synthetic::MakeWorld({}).camera);
  return empty;
}

// A map needs the odometry to begin; then the camera is followed by its landmarks alone.
constexpr int kBeginning = 30;

struct WalkResult {
  std::vector<FramePose> trajectory;
  std::vector<Rigid3> final_poses;  // cam_from_world, of trajectory
  std::shared_ptr<const Map> map;
  std::vector<TrackingState> states;
};

// A camera that walks along the arc of the synthetic world, 0.4 degrees a frame; it sees
// nothing in [blind_from, blind_to). With a slow camera the mapper has
// all the time it needs.
WalkResult RunWalk(RunnerMode mode, int frames, int blind_from = -1, int blind_to = -1,
                   bool slow_camera = false) {
  synthetic::World world = synthetic::MakeWorld({});
  for (double& d : world.max_distance) d = std::min(d, 3.6);
  SlamConfig config = SlamConfig::Offline();
  config.runner.mode = mode;
  Atlas atlas(config, EmptyMap(), false, {});
  WalkResult run;
  Rng rng(7);
  for (int i = 0; i < frames; ++i) {
    const bool blind = i >= blind_from && i < blind_to;
    const double angle = -20 + 0.4 * (i < 80 ? i : 160 - i);
    Frame frame{i, i / 30.0, std::make_shared<const Camera>(world.camera), {}, {}};
    frame.features = synthetic::MakeView(world, synthetic::PoseOnArc({}, angle),
                                         {.missed = blind ? 1.0 : 0.1}, rng)
                         .features;
    if (!blind && i < kBeginning + std::max(0, blind_to))
      frame.motion = synthetic::TrueMotion(i, synthetic::PoseOnArc({}, angle), i >= blind_to);
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

// RMSE of camera centres against the arc after the best similarity (Umeyama 1991), in units of the
// world.
double AbsoluteError(const WalkResult& run) {
  const auto n = static_cast<Eigen::Index>(run.trajectory.size());
  Eigen::Matrix3Xd estimate(3, n), truth(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int f = run.trajectory[i].frame_index;
    estimate.col(i) = run.final_poses[i].OriginInSource();
    truth.col(i) = synthetic::PoseOnArc({}, -20 + 0.4 * (f < 80 ? f : 160 - f)).OriginInSource();
  }
  const Eigen::Matrix4d sim = Eigen::umeyama(estimate, truth, true);
  return std::sqrt(
      ((sim.topLeftCorner<3, 3>() * estimate).colwise() + sim.topRightCorner<3, 1>() - truth)
          .colwise()
          .squaredNorm()
          .mean());
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
  SlamConfig config = SlamConfig::Offline();
  config.runner.mode = RunnerMode::kLive;
  MapPipeline pipeline(config, EmptyMap());
  MapCommand nothing;
  for (nothing.frame_index = 0; nothing.frame_index < 200; ++nothing.frame_index) {
    pipeline.Submit(nothing);
    EXPECT_LE(pipeline.QueueLength(), MapPipeline::kMaxQueued);
  }
  EXPECT_EQ(pipeline.Newest()->version, 201U);
}

TEST(Pipeline, MayEndAtAnyMoment) {
  synthetic::World world = synthetic::MakeWorld({});
  for (const RunnerMode mode :
       {RunnerMode::kSequential, RunnerMode::kLockstep, RunnerMode::kLive}) {
    for (const int end : {0, 1, 5, 9, 10, 11, 12, 13, 14, 25, 40}) {
      SlamConfig config = SlamConfig::Offline();
      config.runner.mode = mode;
      Session session(config, EmptyMap(), false);
      uint32_t next_keyframe = 0, next_object = 0;
      Rng rng(7);
      for (int i = 0; i < end; ++i)
        session.Process(
            {i,
             i / 30.0,
             0,
             synthetic::MakeView(world, synthetic::PoseOnArc({}, -20 + 0.8 * i), {}, rng).features,
             {}},
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
