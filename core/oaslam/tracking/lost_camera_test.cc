#include "oaslam/tracking/lost_camera.h"

#include <gtest/gtest.h>

#include "synthetic_world.h"

namespace oaslam {
namespace {

Frame MovingFrame(int index) {
  Frame frame;
  frame.index = index;
  frame.timestamp = index / 30.0;
  frame.motion = synthetic::TrueMotion(index, synthetic::PoseOnArc({}, 0.4 * index));
  return frame;
}

TEST(LostCamera, KeepsTheMotionsOfTheLastSeconds) {
  constexpr int kKept = 450, kFrames = 500;
  LostCamera camera{SlamConfig::Offline()};
  camera.Keep(Frame{});  // without motion
  for (int i = 0; i < kFrames; ++i) camera.Keep(MovingFrame(i));
  camera.Keep(MovingFrame(kFrames - 1));  // once more, with its detections
  const std::vector<LostCamera::Image> images = camera.TakeImages();
  ASSERT_EQ(images.size(), kKept);
  EXPECT_EQ(images.front().frame_index, kFrames - kKept);
  EXPECT_EQ(images.back().frame_index, kFrames - 1);
  EXPECT_TRUE(camera.TakeImages().empty());
}

TEST(LostCamera, LooksAgainFromTimeToTime) {
  LostCamera camera{SlamConfig::Offline()};
  EXPECT_TRUE(camera.IsTimeToLook(10));
  EXPECT_FALSE(camera.IsTimeToLook(10.1));
  EXPECT_TRUE(camera.IsTimeToLook(10.25));
}

TEST(LostCamera, FindsAnImageInTheMap) {
  const synthetic::World world = synthetic::MakeWorld({});
  const Map map = synthetic::MakeMap(world, {}).map;
  Rng rng(3);
  const Rigid3 pose = synthetic::PoseOnArc({}, 3);
  const Frame frame = MakeFrame(synthetic::MakeView(world, pose, {}, rng));
  LostCamera camera{SlamConfig::Offline()};
  const Relocalization found =
      camera.Find(frame, map, {.search = RelocalizationMode::kPoints}, std::nullopt);
  ASSERT_EQ(found.evidence, PoseEvidence::kPoints);
  EXPECT_LT(CenterDistance(found.cam_from_world, pose), 0.05);
}

// What images before tell of the place ends where the map's unit or the place itself changes.
TEST(LostCamera, ForgetsWhereItWasRegistered) {
  LostCamera camera{SlamConfig::Offline()};
  Relocalization found;
  found.evidence = PoseEvidence::kPoints;
  found.covariance.diagonal().head<3>().setConstant(1e-6);
  for (int i = 0; i < 10; ++i) {
    const Frame frame = MovingFrame(i);
    found.cam_from_world = frame.motion->cam_from_odom;
    camera.Register(frame, Map{}, found, 1.0);
  }
  const auto registered = camera.Registered(MovingFrame(12));
  ASSERT_TRUE(registered);
  EXPECT_LT(CenterDistance(registered->pose.cam_from_world, synthetic::PoseOnArc({}, 0.4 * 12)),
            0.01);
  camera.Forget();
  EXPECT_FALSE(camera.Registered(MovingFrame(12)));
}

}  // namespace
}  // namespace oaslam
