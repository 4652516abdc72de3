#include "oaslam/tracking/trajectory.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/camera_model.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

struct TrajectoryScene {
  synthetic::World world = synthetic::MakeWorld({});
  synthetic::MappedWorld mapped = synthetic::MakeMap(world, {});
  Rigid3 truth = synthetic::PoseOnArc({}, 3);
  Frame frame;
  std::vector<LandmarkId> landmarks;
  Rigid3 wrong = Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.02, 0, 0)) * truth;

  TrajectoryScene() {
    Rng rng(4);
    const synthetic::View view = synthetic::MakeView(world, truth, {}, rng);
    frame = {20, 0.6, view.camera, view.features, {}};
    landmarks = mapped.LandmarksIn(view);
  }
  FramePose Pose(int index) const {
    const KeyframeId reference(2);
    return {index, index / 30.0, reference,
            wrong * mapped.map.keyframes.At(reference).cam_from_world.Inverse(),
            TrackingState::kTracking};
  }
  double Error(const FramePose& pose) const {
    return CenterDistance(pose.cam_from_reference * *mapped.map.ResolvePose(pose.reference), truth);
  }
};

TEST(Trajectory, RefinesAFrameWithTheMapAsItIsLater) {
  const TrajectoryScene s;
  Trajectory trajectory;
  trajectory.Add(s.Pose(20), s.frame, s.landmarks);
  trajectory.RefinePosesBefore(s.mapped.map, 20);
  EXPECT_NEAR(s.Error(trajectory.poses().front()), 0.02, 1e-9);
  trajectory.RefinePosesBefore(s.mapped.map, 21);
  EXPECT_LT(s.Error(trajectory.poses().front()), 0.004);
}

TEST(Trajectory, ACarriedFrameMovesWithTheOneItWasCarriedFrom) {
  const TrajectoryScene s;
  Trajectory trajectory;
  trajectory.Add(s.Pose(20), s.frame, s.landmarks);
  trajectory.AddCarried(s.Pose(21), 20, Rigid3());
  trajectory.RefinePosesBefore(s.mapped.map, 100);
  EXPECT_LT(s.Error(trajectory.poses().back()), 0.004);
  EXPECT_EQ(trajectory.poses().back().cam_from_reference.translation,
            trajectory.poses().front().cam_from_reference.translation);
}

TEST(Trajectory, KeepsThePoseWhereTheMapForgotWhatTheFrameSaw) {
  TrajectoryScene s;
  Trajectory trajectory;
  trajectory.Add(s.Pose(20), s.frame, s.landmarks);
  int seen = 0;
  for (const LandmarkId id : s.landmarks)
    if (id.IsValid() && s.mapped.map.landmarks.Contains(id) && ++seen % 2 == 0)
      s.mapped.map.EraseLandmark(id);
  trajectory.RefinePosesBefore(s.mapped.map, 100);
  EXPECT_NEAR(s.Error(trajectory.poses().front()), 0.02, 1e-9);
}

TEST(Trajectory, KeepsThePoseThatTheOdometryGaveAgainstThePoints) {
  const TrajectoryScene s;
  Trajectory trajectory;
  FramePose pose = s.Pose(20);
  pose.state = TrackingState::kOdometry;
  trajectory.Add(pose, s.frame, s.landmarks);
  trajectory.RefinePosesBefore(s.mapped.map, 100);
  EXPECT_NEAR(s.Error(trajectory.poses().front()), 0.02, 1e-9);
}

TEST(Trajectory, FramesComeInAnyOrderAndKeyframesCarryThemselves) {
  const TrajectoryScene s;
  Trajectory trajectory;
  for (const int index : {5, 9, 7, 20}) trajectory.Add(s.Pose(index), s.frame, s.landmarks);
  trajectory.MakeKeyframe(trajectory.poses().back().frame_index, KeyframeId(3));
  trajectory.RefinePosesBefore(s.mapped.map, 100);
  std::vector<int> order;
  for (const FramePose& p : trajectory.poses()) order.push_back(p.frame_index);
  EXPECT_EQ(order, (std::vector{5, 7, 9, 20}));
  EXPECT_EQ(trajectory.poses().back().reference, KeyframeId(3));
  EXPECT_EQ(trajectory.poses().back().cam_from_reference.translation, Eigen::Vector3d(0, 0, 0));
}

TEST(Trajectory, ForgetsTheOldestOfThoseThatWereNotMapped) {
  const TrajectoryScene s;
  Trajectory trajectory;
  const auto add = [&](int first, int end) {
    for (int i = first; i < end; ++i) trajectory.Add(s.Pose(i), s.frame, {});
  };
  add(0, 10);
  EXPECT_FALSE(trajectory.KeepNewestAfter(9, 8));
  add(10, 19);
  EXPECT_FALSE(trajectory.KeepNewestAfter(9, 8));  // many are forgotten at once
  add(19, 30);
  EXPECT_TRUE(trajectory.KeepNewestAfter(9, 8));
  EXPECT_EQ(trajectory.poses().size(), 18U);
  EXPECT_TRUE(trajectory.PoseOf(0) && trajectory.PoseOf(9) && trajectory.PoseOf(22));
  EXPECT_FALSE(trajectory.PoseOf(10) || trajectory.PoseOf(21));
}

}  // namespace
}  // namespace oaslam
