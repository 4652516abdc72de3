#include "oaslam/features/orb_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grey_scene.h"
#include "instruction_sets.h"

namespace oaslam {
namespace {

// Ordinary and difficult images, with widths that are no multiple of any vector.
std::vector<GreyBuffer> Images() {
  using synthetic::Drawn, synthetic::Noise;
  std::vector<GreyBuffer> images{Noise(40, 30, 1), Noise(77, 41, 2), Noise(131, 64, 3),
                                 GreyBuffer(63, 50)};
  images.push_back(Drawn(97, 45, [](int, int) { return 255; }));
  Rng rng(4);
  images.push_back(Drawn(101, 55, [&](int, int) { return rng.Index(2) * 255; }));
  const auto smooth = [](int x, int y) {
    return 127.5 + 70 * std::sin(0.9 * x + 0.3 * y) + 57 * std::sin(0.8 * y - 0.5 * x);
  };
  images.push_back(Drawn(203, 90, smooth));
  images.push_back(Drawn(88, 61, [](int x, int y) { return (x / 5 + y / 5) % 2 * 255; }));
  images.push_back(Drawn(111, 60, smooth, 7));  // rows are not contiguous
  return images;
}

// The score by its definition, arc by arc.
int PlainScore(const GreyImage& image, int x, int y) {
  constexpr int kRingX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kRingY[16] = {3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};
  int best = 0;
  for (int start = 0; start < 16; ++start) {
    int brighter = 255, darker = 255;
    for (int k = start; k < start + 9; ++k) {
      const int difference = image.Row(y + kRingY[k % 16])[x + kRingX[k % 16]] - image.Row(y)[x];
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    best = std::max({best, brighter, darker});
  }
  return best;
}

std::vector<Corner> PlainFast(const GreyImage& image, int threshold) {
  GreyBuffer scores(image.width, image.height);
  const auto at = [&](int x, int y) { return static_cast<float>(scores.Row(y)[x]); };
  for (int y = 3; y < image.height - 3; ++y)
    for (int x = 3; x < image.width - 3; ++x)
      if (const int score = PlainScore(image, x, y); score > threshold)
        scores.Row(y)[x] = static_cast<uint8_t>(score);
  std::vector<Corner> corners;
  for (int y = 3; y < image.height - 3; ++y)
    for (int x = 3; x < image.width - 3; ++x) {
      bool is_maximum = at(x, y) > 0;
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u)
          if (u || v) is_maximum = is_maximum && at(x, y) > at(x + u, y + v);
      const auto top = [&](float before, float after) {
        return 0.5F * (before - after) / (before - 2 * at(x, y) + after);
      };
      if (is_maximum)
        corners.push_back({x, y, scores.Row(y)[x], top(at(x - 1, y), at(x + 1, y)),
                           top(at(x, y - 1), at(x, y + 1))});
    }
  return corners;
}

double PlainBlur(const GreyImage& image, int x, int y) {
  constexpr int kWeights[4] = {56, 48, 34, 18};
  const auto mirrored = [](int i, int size) { return size - 1 - std::abs(size - 1 - std::abs(i)); };
  double sum = 0;
  for (int v = -3; v <= 3; ++v)
    for (int u = -3; u <= 3; ++u)
      sum += kWeights[std::abs(u)] * kWeights[std::abs(v)] *
             image.Row(mirrored(y + v, image.height))[mirrored(x + u, image.width)];
  return sum / 65536;
}

class OrbKernels : public EveryInstructionSet {};
INSTANTIATE_TEST_SUITE_P(Targets, OrbKernels, testing::ValuesIn(InstructionSets()),
                         NameOfInstructionSet);

TEST_P(OrbKernels, FastFindsWhatTheDefinitionFinds) {
  std::vector<uint8_t> scores;
  size_t found = 0;
  for (const GreyBuffer& image : Images())
    for (const int threshold : {1, 7, 20, 90, 254}) {
      const std::vector<Corner> fast = DetectFast(image.view(), static_cast<uint8_t>(threshold),
                                                  scores),
                                plain = PlainFast(image.view(), threshold);
      ASSERT_EQ(fast.size(), plain.size()) << image.width() << " " << threshold;
      for (size_t i = 0; i < fast.size(); ++i) {
        EXPECT_EQ(fast[i].x, plain[i].x);
        EXPECT_EQ(fast[i].y, plain[i].y);
        EXPECT_EQ(fast[i].score, plain[i].score);
        EXPECT_FLOAT_EQ(fast[i].dx, plain[i].dx);
        EXPECT_FLOAT_EQ(fast[i].dy, plain[i].dy);
        EXPECT_LE(std::max(std::abs(fast[i].dx), std::abs(fast[i].dy)), 0.5F);
      }
      found += fast.size();
    }
  EXPECT_GT(found, 1000U);
}

TEST_P(OrbKernels, BlurIsWithinRoundingOfTheGaussian) {
  for (const GreyBuffer& image : Images()) {
    GreyBuffer blurred(image.width(), image.height());
    BlurGaussian7(image.view(), blurred.Row(0), blurred.step());
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        ASSERT_NEAR(blurred.Row(y)[x], PlainBlur(image.view(), x, y), 0.55) << x << " " << y;
  }
}

TEST_P(OrbKernels, MomentsAreThoseOfTheDisc) {
  for (const GreyBuffer& image : Images()) {
    if (image.height() < 40) continue;
    for (int y = 19; y < image.height() - 19; y += 7)
      for (int x = 19; x < image.width() - 19; x += 5) {
        Moments plain;
        for (int v = -15; v <= 15; ++v)
          for (int u = -15; u <= 15; ++u)
            if (std::abs(u) <= DiscHalfWidths()[std::abs(v)]) {
              plain.x += u * image.Row(y + v)[x + u];
              plain.y += v * image.Row(y + v)[x + u];
            }
        const Moments moments = PatchMoments(image.Row(y) + x, image.step());
        EXPECT_EQ(moments.x, plain.x);
        EXPECT_EQ(moments.y, plain.y);
      }
  }
}

TEST_P(OrbKernels, DescriptorsCompareTheTurnedPattern) {
  const GreyBuffer image = synthetic::Noise(150, 80, 9);
  for (int degrees = 0; degrees < 360; degrees += 11) {
    const double angle = degrees * M_PI / 180;
    const PatchDirection direction = DirectionOf(
        {static_cast<int>(1e6 * std::cos(angle)), static_cast<int>(1e6 * std::sin(angle))});
    const int x = 30 + degrees / 5, y = 40;
    const auto value = [&](int i) {
      const auto turned = [&](double a, double b) {
        return static_cast<int>(std::floor((a + b) / 1024 + 0.5));
      };
      const double px = GetOrbPattern().x[i], py = GetOrbPattern().y[i];
      return image.Row(
          y + turned(px * direction.sin,
                     py * direction.cos))[x + turned(px * direction.cos, -py * direction.sin)];
    };
    const Descriptor d = Describe(image.Row(y) + x, image.step(), direction);
    for (int bit = 0; bit < 256; ++bit)
      ASSERT_EQ((d[bit / 64] >> (bit % 64)) & 1, value(bit) < value(256 + bit))
          << degrees << " " << bit;
  }
}

TEST(OrbPattern, StaysWithinItsReachAtAnyAngle) {
  for (size_t i = 0; i < 512; ++i)
    EXPECT_LT(std::hypot(GetOrbPattern().x[i], GetOrbPattern().y[i]) + 0.5, kPatternReach);
}

TEST(DirectionOf, AnEvenPatchPointsAlongX) {
  EXPECT_EQ(DirectionOf({}).cos, 1024);
  EXPECT_EQ(DirectionOf({0, -5}).sin, -1024);
}

}  // namespace
}  // namespace oaslam
