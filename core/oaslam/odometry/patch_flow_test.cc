#include "oaslam/odometry/patch_flow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "oaslam/odometry/corners.h"
#include "oaslam/odometry/patch_kernels.h"
#include "oaslam/odometry/point_flow.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

constexpr int kWidth = 320, kHeight = 240;

// A smooth texture of three waves whose lengths are no multiples of each other, moved by `shift`.
std::vector<uint8_t> Texture(const Eigen::Vector2d& shift, double brightness = 0) {
  std::vector<uint8_t> pixels;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double u = x - shift.x(), v = y - shift.y();
      const double value = 120 + brightness + 35 * std::sin(0.31 * u + 0.11 * v) +
                           30 * std::sin(0.37 * v - 0.07 * u) + 25 * std::sin(0.023 * (u + 2 * v));
      pixels.push_back(static_cast<uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))));
    }
  return pixels;
}

GreyPyramid PyramidOf(const std::vector<uint8_t>& pixels, int levels = 4) {
  return GreyPyramid({pixels.data(), kWidth, kWidth, kHeight}, levels);
}

TEST(GreyPyramid, HalvesWithoutMovingTheImage) {
  std::vector<uint8_t> pixels(kWidth * kHeight, 10);
  pixels[64 * kWidth + 100] = 250;  // even: its place is a pixel of the next level
  const GreyPyramid pyramid = PyramidOf(pixels);
  ASSERT_EQ(pyramid.levels(), 3);  // the fourth would be 40 x 30, less than twice the border
  const GreyImage half = pyramid.level(1);
  EXPECT_EQ(half.width, kWidth / 2);
  EXPECT_EQ(half.height, kHeight / 2);
  EXPECT_EQ(half.data[32 * half.step + 50], 10 + (240 * 36 + 128) / 256);
  EXPECT_EQ(half.data[32 * half.step + 49], 10 + (240 * 6 + 128) / 256);
  EXPECT_EQ(half.data[32 * half.step + 53], 10);
}

TEST(GreyPyramid, TheBorderMirrorsTheImage) {
  const std::vector<uint8_t> pixels = Texture({0, 0});
  const GreyPyramid pyramid = PyramidOf(pixels);
  const GreyImage image = pyramid.level(0);
  for (const int i : {1, 7, GreyPyramid::kBorder}) {
    EXPECT_EQ(image.data[-i], pixels[i]);
    EXPECT_EQ(image.data[-i * image.step + 5], pixels[i * kWidth + 5]);
    EXPECT_EQ(image.data[(kHeight - 1 + i) * image.step + kWidth - 1 + i],
              pixels[(kHeight - 1 - i) * kWidth + kWidth - 1 - i]);
  }
}

TEST(PatchKernels, DeriveAPlaneExactly) {
  std::vector<uint8_t> pixels;  // 4 grey levels a column, 2 a row
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) pixels.push_back(static_cast<uint8_t>(10 + 4 * x + 2 * y));
  constexpr int one = 1 << kPatchGreyBits, n = kPatchSide * kPatchSide;
  const PatchPlace first{pixels.data() + 3 * 40 + 5, 40, 1 << 14, 1 << 13};  // (5.5, 3.25)
  DerivedPatch patch;
  DerivePatch(first, patch);
  for (int r = 0; r < kPatchSide; ++r)
    for (int c = 0; c < kPatchSide; ++c) {
      const int i = r * kPatchSide + c;
      EXPECT_EQ(patch.grey[i], one * (10 + 4 * (c + 6) + 2 * (r + 4)) + one * 4 / 2 + one * 2 / 4);
      EXPECT_EQ(patch.dx[i], 2 * one * 4);
      EXPECT_EQ(patch.dy[i], 2 * one * 2);
    }
  EXPECT_EQ(patch.sum_x, n * 2 * one * 4);
  EXPECT_EQ(patch.xy, n * 2 * one * 4 * 2 * one * 2);
  // The patch itself begins a pixel right of and below its rim.
  PatchPlace same = first;
  same.pixel += 40 + 1;
  EXPECT_EQ(ComparePatch(patch, same).by_x, 0);
  same.pixel += 2;
  EXPECT_EQ(ComparePatch(patch, same).sum, n * one * 4 * 2);
  EXPECT_EQ(ComparePatch(patch, same).by_y, n * one * 4 * 2 * 2 * one * 2);
}

TEST(PatchFlow, FindsAShiftToAFractionOfAPixel) {
  const GreyPyramid first = PyramidOf(Texture({0, 0}));
  for (const Eigen::Vector2d& shift : {Eigen::Vector2d(0.3, -0.6), Eigen::Vector2d(-4.25, 2.5)}) {
    const GreyPyramid second = PyramidOf(Texture(shift));
    for (const Eigen::Vector2f& px : {Eigen::Vector2f(100, 80), Eigen::Vector2f(211.4F, 150.7F)}) {
      const auto found = FollowPatch(first, second, px, px, {});
      ASSERT_TRUE(found);
      EXPECT_LT((*found - px - shift.cast<float>()).norm(), 0.03) << shift.transpose();
    }
  }
}

TEST(PatchFlow, BrightnessDoesNotMatter) {
  const Eigen::Vector2f px(100, 80);
  const auto found =
      FollowPatch(PyramidOf(Texture({0, 0})), PyramidOf(Texture({1.5, 0.5}, 20)), px, px, {});
  ASSERT_TRUE(found);
  EXPECT_LT((*found - px - Eigen::Vector2f(1.5F, 0.5F)).norm(), 0.03);
}

TEST(PatchFlow, APatchWithoutTextureIsNotFound) {
  const std::vector<uint8_t> grey(kWidth * kHeight, 128);
  // An edge holds a patch in one direction only.
  std::vector<uint8_t> edge(kWidth * kHeight, 50);
  for (int i = 0; i < kWidth * kHeight; ++i)
    if (i % kWidth >= 100) edge[i] = 200;
  const Eigen::Vector2f px(100, 80);
  EXPECT_FALSE(FollowPatch(PyramidOf(grey), PyramidOf(grey), px, px, {}));
  EXPECT_FALSE(FollowPatch(PyramidOf(edge), PyramidOf(edge), px, px, {}));
}

TEST(PatchFlow, OutsideOfTheImageNothingIsFound) {
  const GreyPyramid first = PyramidOf(Texture({0, 0})), second = PyramidOf(Texture({-8, 0}));
  EXPECT_FALSE(FollowPatch(first, second, {4, 80}, {4, 80}, {}));  // it has left the image
  EXPECT_FALSE(FollowPatch(first, second, {-1, 80}, {4, 80}, {}));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(FollowPatch(first, second, {100, 80}, {nan, 80}, {}));
}

TEST(PointFlow, PointsWithBadGuessesFollowTheirNeighbours) {
  // Random blots: waves would look alike a wave away.
  Rng rng(3);
  std::vector<uint8_t> small(kWidth * kHeight / 16);
  for (uint8_t& p : small) p = static_cast<uint8_t>(rng.Index(256));
  const auto image = [&](int dx) {
    std::vector<uint8_t> pixels;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const double u = (x - dx + kWidth) % kWidth / 4.0, v = y / 4.0;
        const int iu = static_cast<int>(u), iv = static_cast<int>(v);
        const double fu = u - iu, fv = v - iv;
        const auto at = [&](int a, int b) {
          return small[std::min(b, kHeight / 4 - 1) * (kWidth / 4) + a % (kWidth / 4)];
        };
        pixels.push_back(
            static_cast<uint8_t>((1 - fv) * ((1 - fu) * at(iu, iv) + fu * at(iu + 1, iv)) +
                                 fv * ((1 - fu) * at(iu, iv + 1) + fu * at(iu + 1, iv + 1))));
      }
    return pixels;
  };
  const GreyPyramid first = PyramidOf(image(0)), second = PyramidOf(image(6));
  std::vector<PointToFollow> points;
  for (int y = 60; y <= 180; y += 12)
    for (int x = 60; x <= 240; x += 12) {
      const Eigen::Vector2f px(static_cast<float>(x), static_cast<float>(y));
      const bool is_bad = points.size() % 2 == 0;
      points.push_back({px, px + Eigen::Vector2f(is_bad ? 60 : 6, 0)});
    }
  const auto places = FollowPoints(points, first, second);
  int right = 0;
  for (size_t i = 0; i < points.size(); ++i)
    right += places[i] && (*places[i] - points[i].px - Eigen::Vector2f(6, 0)).norm() < 0.1;
  EXPECT_GT(right,
            0.8 * static_cast<double>(points.size()));  // half of them, without their neighbours
}

TEST(Corners, StandInEachCellAndApartFromEachOther) {
  std::vector<uint8_t> pixels(kWidth * kHeight);
  for (int i = 0; i < kWidth * kHeight; ++i)
    pixels[i] = (i % kWidth / 20 + i / kWidth / 20) % 2 ? 200 : 50;  // a chessboard
  const GreyImage image{pixels.data(), kWidth, kWidth, kHeight};
  const CornerGrid grid{.cell = 40, .per_cell = 2, .max_points = 400};
  const std::vector<Eigen::Vector2f> corners = FindCorners(image, {}, grid);
  EXPECT_EQ(corners.size(), 2 * 8 * 6);
  for (size_t i = 0; i < corners.size(); ++i) {
    // At a crossing, or beside it: the derivatives of a step edge reach over two pixels.
    for (const float x : {corners[i].x(), corners[i].y()})
      EXPECT_LT(std::abs(x - 20 * std::round(x / 20)), 3) << corners[i].transpose();
    for (size_t j = 0; j < i; ++j) EXPECT_GT((corners[i] - corners[j]).norm(), grid.cell / 4);
  }
  // A cell that has its points gets no more, and none near them.
  EXPECT_TRUE(FindCorners(image, corners, grid).empty());
  const std::vector<Eigen::Vector2f> some(corners.begin(), corners.begin() + 10);
  for (const Eigen::Vector2f& added : FindCorners(image, some, grid))
    for (const Eigen::Vector2f& s : some) EXPECT_GT((added - s).norm(), grid.cell / 4);
}

}  // namespace
}  // namespace oaslam
