#include "oaslam/tracking/continuity.h"

#include <gtest/gtest.h>

#include "synthetic_world.h"

namespace oaslam {
namespace {

// One camera went through two submaps; the second one is placed correctly, or too far away.
TEST(Continuity, ACameraDoesNotJumpBetweenSubmaps) {
  synthetic::World world = synthetic::MakeWorld({});
  const Map map = synthetic::MakeMap(world, {}).map;
  const auto way = [&](int first, int last, double scale) {
    std::vector<FramePose> poses;
    const Rigid3 reference = map.keyframes.At(KeyframeId(0)).cam_from_world;
    for (int i = first; i < last; ++i) {
      Rigid3 pose = synthetic::PoseOnArc({}, -20 + 0.4 * i) * reference.Inverse();
      pose.translation *= scale;
      poses.push_back({i, i / 30.0, KeyframeId(0), pose});
    }
    return poses;
  };
  const std::vector<FramePose> first = way(0, 40, 1), second = way(45, 90, 1);
  EXPECT_TRUE(IsContinuous(map, first, map, second, Similarity()));
  EXPECT_FALSE(IsContinuous(map, first, map, second,
                            Similarity(1, Eigen::Quaterniond::Identity(), {1.5, 0, 0})));
  EXPECT_TRUE(
      IsContinuous(map, first, map, way(90, 120, 1),
                   Similarity(1, Eigen::Quaterniond::Identity(), {1.5, 0, 0})));  // too long after
}

}  // namespace
}  // namespace oaslam
