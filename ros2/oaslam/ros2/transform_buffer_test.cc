#include "oaslam/ros2/transform_buffer.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

RosTransform Shift(const std::string& parent, const std::string& child, double x, double seconds) {
  return {parent,
          child,
          {Rigid3::Rotation::Identity(), {x, 0, 0}},
          static_cast<int64_t>(seconds * kSecond)};
}

double X(const std::optional<Rigid3>& transform) {
  return transform ? transform->translation.x() : -1000;
}

struct TransformBuffers : testing::Test {
  TransformBuffer buffer;
  TransformBuffers() {
    buffer.Add(Shift("base", "mast", 1, 0), true);
    buffer.Add(Shift("mast", "camera", 2, 0), true);
    buffer.Add(Shift("odom", "base", 10, 5), false);
    buffer.Add(Shift("odom", "base", 20, 6), false);
  }
};

TEST_F(TransformBuffers, FollowTheTree) {
  EXPECT_DOUBLE_EQ(X(buffer.Find("base", "camera", 77 * kSecond)), 3);
  EXPECT_DOUBLE_EQ(X(buffer.Find("camera", "base", 77 * kSecond)), -3);
  EXPECT_DOUBLE_EQ(X(buffer.Find("odom", "camera", 5 * kSecond)), 13);
  buffer.Add(Shift("base", "imu", 5, 0), true);
  EXPECT_DOUBLE_EQ(X(buffer.Find("camera", "imu", 0)), 2);
  EXPECT_TRUE(buffer.HasParent("base"));
  EXPECT_FALSE(buffer.HasParent("odom"));
}

TEST_F(TransformBuffers, InterpolateAndNeverGuess) {
  EXPECT_DOUBLE_EQ(X(buffer.Find("odom", "base", 11 * kSecond / 2)), 15);
  EXPECT_DOUBLE_EQ(X(buffer.Find("odom", "base", 6 * kSecond)), 20);
  EXPECT_FALSE(buffer.Find("odom", "base", 6 * kSecond + 1));
  EXPECT_FALSE(buffer.Find("odom", "base", 5 * kSecond - 1));
  EXPECT_TRUE(buffer.Connects("odom", "camera"));
  EXPECT_FALSE(buffer.Connects("map", "camera"));
  EXPECT_FALSE(buffer.Find("map", "camera", 5 * kSecond));
}

TEST_F(TransformBuffers, KeepTenSeconds) {
  buffer.Add(Shift("odom", "base", 30, 15.5), false);
  EXPECT_FALSE(buffer.Find("odom", "base", 5 * kSecond));
  EXPECT_DOUBLE_EQ(X(buffer.Find("odom", "base", 6 * kSecond)), 20);
  buffer.ForgetMoving();
  EXPECT_FALSE(buffer.Connects("odom", "base"));
  EXPECT_TRUE(buffer.Connects("base", "camera"));
}

TEST_F(TransformBuffers, BeginAnewWhereTheClockIsSetBack) {
  buffer.Add(Shift("odom", "base", 30, 9000), false);  // far in the future
  buffer.Add(Shift("odom", "base", 40, 7), false);
  buffer.Add(Shift("odom", "base", 50, 8), false);
  EXPECT_DOUBLE_EQ(X(buffer.Find("odom", "base", 15 * kSecond / 2)), 45);
}

TEST_F(TransformBuffers, AreBounded) {
  for (int i = 0; i < 3000; ++i)
    buffer.Add(Shift("f" + std::to_string(i), "f" + std::to_string(i + 1), 1, 0), true);
  EXPECT_FALSE(buffer.HasParent("f2900"));
  EXPECT_FALSE(buffer.Connects("f900", "f0")) << "so long is no robot";
  EXPECT_TRUE(buffer.Connects("odom", "camera"));
}

TEST_F(TransformBuffers, SurviveALoop) {
  buffer.Add(Shift("camera", "odom", 1, 0), true);
  EXPECT_TRUE(buffer.Connects("odom", "camera"));
  EXPECT_FALSE(buffer.Connects("odom", "map"));
}

}  // namespace
}  // namespace oaslam
