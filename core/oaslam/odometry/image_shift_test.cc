#include "oaslam/odometry/image_shift.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "grey_scene.h"

namespace oaslam {
namespace {

constexpr int kDiscsWidth = 320, kDiscsHeight = 240;
constexpr float kBlock = kDiscsWidth / 40.0F;

// Discs of random grey, moved by `shift`; those of a strip along the edges come into view with it.
GreyPyramid Discs(const Eigen::Vector2d& shift, double contrast = 1, double brightness = 0) {
  Rng rng(3);
  std::vector<double> grey(kDiscsWidth * kDiscsHeight, 100.0);
  for (int k = 0; k < 150; ++k) {
    const double x = rng.Uniform(-kDiscsWidth, 2 * kDiscsWidth) + shift.x(),
                 y = rng.Uniform(-kDiscsHeight, 2 * kDiscsHeight) + shift.y(),
                 radius = rng.Uniform(8, 40), value = rng.Uniform(20, 200);
    for (int v = 0; v < kDiscsHeight; ++v)
      for (int u = 0; u < kDiscsWidth; ++u)
        if (std::hypot(u - x, v - y) < radius) grey[v * kDiscsWidth + u] = value;
  }
  const GreyBuffer image = synthetic::Drawn(kDiscsWidth, kDiscsHeight, [&](int x, int y) {
    const double seen = contrast * grey[y * kDiscsWidth + x] + brightness;
    return std::lround(std::clamp(seen, 0.0, 255.0));
  });
  return GreyPyramid(image.view(), 5);
}

TEST(ShiftOfImage, IsFoundUpToHalfOfTheImage) {
  for (const Eigen::Vector2d& shift : {Eigen::Vector2d(0, 0), Eigen::Vector2d(90, -40),
                                       Eigen::Vector2d(-160, 10), Eigen::Vector2d(35, 110)}) {
    const Eigen::Vector2f found = ShiftOfImage(Discs({0, 0}), Discs(shift));
    EXPECT_LT((found.cast<double>() - shift).cwiseAbs().maxCoeff(), kBlock) << shift.transpose();
  }
}

TEST(ShiftOfImage, IsThatOfTheContentWhateverTheExposure) {
  const Eigen::Vector2f found = ShiftOfImage(Discs({0, 0}), Discs({-70, 30}, 0.6, 60));
  EXPECT_LT((found - Eigen::Vector2f(-70, 30)).cwiseAbs().maxCoeff(), kBlock);
}

TEST(ShiftOfImage, IsZeroWithoutTexture) {
  const std::vector<uint8_t> grey(kDiscsWidth * kDiscsHeight, 128);
  const GreyPyramid plain({grey.data(), kDiscsWidth, kDiscsWidth, kDiscsHeight}, 5);
  EXPECT_EQ(ShiftOfImage(plain, plain), Eigen::Vector2f(0, 0));
  EXPECT_EQ(ShiftOfImage(plain, Discs({0, 0})), Eigen::Vector2f(0, 0));
}

}  // namespace
}  // namespace oaslam
