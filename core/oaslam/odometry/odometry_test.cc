#include "oaslam/odometry/odometry.h"

#include <gtest/gtest.h>

#include "grey_scene.h"

namespace oaslam {
namespace {

constexpr int kWallWidth = 320, kWallHeight = 240;

// A camera that looks at a wall of noise in squares.
class OdometryTest : public testing::Test {
 protected:
  OdometryEstimate See(const GreyBuffer& image) {
    return odometry_.Process(image.view(), ++images_ / 30.0);
  }
  OdometryEstimate SeeFrom(int place) {
    return See(synthetic::Drawn(kWallWidth, kWallHeight,
                                [&](int x, int y) { return wall_.At(place + x, y); }));
  }

  const synthetic::NoiseSquares wall_{200, 4, 1};
  Odometry odometry_{
      {.width = kWallWidth, .height = kWallHeight, .fx = 300, .fy = 300, .cx = 160, .cy = 120},
      {},
      0};
  int images_ = 0;
};

TEST_F(OdometryTest, AWallThatMovesIsFollowed) {
  OdometryEstimate estimate;
  for (int i = 0; i < 10; ++i) estimate = SeeFrom(2 * i);
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_EQ(estimate.run, 0);
  EXPECT_EQ(estimate.image, 9);
  EXPECT_GT(estimate.tracked, 40);
}

TEST_F(OdometryTest, ASuddenTurnIsFollowed) {
  for (int i = 0; i < 5; ++i) SeeFrom(2 * i);
  const OdometryEstimate estimate = SeeFrom(100);  // a quarter of the image
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_EQ(estimate.run, 0);
  EXPECT_GT(estimate.tracked, 40);
}

TEST_F(OdometryTest, AnImageWithoutTextureEndsTheRun) {
  for (int i = 0; i < 5; ++i) SeeFrom(2 * i);
  const auto even = [](int, int) { return 90; };
  EXPECT_EQ(See(synthetic::Drawn(kWallWidth, kWallHeight, even)).state, OdometryState::kBlind);
  OdometryEstimate estimate;
  for (int i = 0; i < 5; ++i) estimate = SeeFrom(10 + 2 * i);
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_GT(estimate.run, 0);
  EXPECT_GT(estimate.tracked, 40);
}

}  // namespace
}  // namespace oaslam
