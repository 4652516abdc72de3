#include "oaslam/odometry/odometry.h"

#include <gtest/gtest.h>

#include <vector>

namespace oaslam {
namespace {

constexpr int kWallWidth = 320, kWallHeight = 240;

// Noise in squares of four pixels.
class Wall {
 public:
  explicit Wall(uint64_t seed) {
    Rng rng(seed);
    for (int i = 0; i < kSide * kSide; ++i)
      squares_.push_back(static_cast<uint8_t>(rng.Uniform(20, 235)));
  }

  std::vector<uint8_t> SeenFrom(int x) const {
    std::vector<uint8_t> image;
    for (int r = 0; r < kWallHeight; ++r)
      for (int c = 0; c < kWallWidth; ++c)
        image.push_back(squares_[(r / 4) * kSide + (c + x) / 4 % kSide]);
    return image;
  }

 private:
  static constexpr int kSide = 200;
  std::vector<uint8_t> squares_;
};

class OdometryTest : public testing::Test {
 protected:
  OdometryEstimate See(const std::vector<uint8_t>& image) {
    return odometry_.Process({image.data(), kWallWidth, kWallWidth, kWallHeight}, ++images_ / 30.0);
  }

  Odometry odometry_{
      {.width = kWallWidth, .height = kWallHeight, .fx = 300, .fy = 300, .cx = 160, .cy = 120},
      {},
      0};
  int images_ = 0;
};

TEST_F(OdometryTest, AWallThatMovesIsFollowed) {
  const Wall wall(1);
  OdometryEstimate estimate;
  for (int i = 0; i < 10; ++i) estimate = See(wall.SeenFrom(2 * i));
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_EQ(estimate.run, 0);
  EXPECT_EQ(estimate.image, 9);
  EXPECT_GT(estimate.tracked, 40);
}

TEST_F(OdometryTest, ASuddenTurnIsFollowed) {
  const Wall wall(1);
  for (int i = 0; i < 5; ++i) See(wall.SeenFrom(2 * i));
  const OdometryEstimate estimate = See(wall.SeenFrom(100));  // a quarter of the image
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_EQ(estimate.run, 0);
  EXPECT_GT(estimate.tracked, 40);
}

TEST_F(OdometryTest, AnImageWithoutTextureEndsTheRun) {
  const Wall wall(1);
  for (int i = 0; i < 5; ++i) See(wall.SeenFrom(2 * i));
  EXPECT_EQ(See(std::vector<uint8_t>(kWallWidth * kWallHeight, 90)).state, OdometryState::kBlind);
  OdometryEstimate estimate;
  for (int i = 0; i < 5; ++i) estimate = See(wall.SeenFrom(10 + 2 * i));
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_GT(estimate.run, 0);
  EXPECT_GT(estimate.tracked, 40);
}

}  // namespace
}  // namespace oaslam
