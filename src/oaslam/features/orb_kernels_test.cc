#include "oaslam/features/orb_kernels.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

GreyImage View(const cv::Mat& image) {
  return {image.ptr<uint8_t>(), static_cast<std::ptrdiff_t>(image.step), image.cols, image.rows};
}

cv::Mat Noise(int width, int height, uint64_t seed) {
  cv::Mat image(height, width, CV_8UC1);
  Rng rng(seed);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.at<uint8_t>(y, x) = static_cast<uint8_t>(rng.Index(256));
  return image;
}

// Ordinary and difficult images, with widths that are no multiple of any vector.
std::vector<cv::Mat> Images() {
  std::vector<cv::Mat> images{Noise(40, 30, 1), Noise(77, 41, 2), Noise(131, 64, 3),
                              cv::Mat::zeros(50, 63, CV_8UC1)};
  images.emplace_back(45, 97, CV_8UC1, cv::Scalar(255));
  cv::Mat saturated = Noise(101, 55, 4) > 127;
  images.push_back(saturated);
  cv::Mat smooth;
  cv::GaussianBlur(Noise(203, 90, 5), smooth, {0, 0}, 2.5);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  images.push_back(smooth);
  cv::Mat board(61, 88, CV_8UC1);
  for (int y = 0; y < board.rows; ++y)
    for (int x = 0; x < board.cols; ++x) board.at<uint8_t>(y, x) = (x / 5 + y / 5) % 2 ? 255 : 0;
  images.push_back(board);
  images.push_back(smooth(cv::Rect(11, 7, 111, 60)));  // rows are not contiguous
  return images;
}

// The score by its definition, arc by arc.
int PlainScore(const cv::Mat& image, int x, int y) {
  constexpr int kRingX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kRingY[16] = {3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};
  int best = 0;
  for (int start = 0; start < 16; ++start) {
    int brighter = 255, darker = 255;
    for (int k = start; k < start + 9; ++k) {
      const int difference =
          image.at<uint8_t>(y + kRingY[k % 16], x + kRingX[k % 16]) - image.at<uint8_t>(y, x);
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    best = std::max({best, brighter, darker});
  }
  return best;
}

std::vector<Corner> PlainFast(const cv::Mat& image, int threshold) {
  cv::Mat_<int> scores(image.size(), 0);
  for (int y = 3; y < image.rows - 3; ++y)
    for (int x = 3; x < image.cols - 3; ++x)
      if (const int score = PlainScore(image, x, y); score > threshold) scores(y, x) = score;
  std::vector<Corner> corners;
  for (int y = 3; y < image.rows - 3; ++y)
    for (int x = 3; x < image.cols - 3; ++x) {
      bool is_maximum = scores(y, x) > 0;
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u)
          if (u || v) is_maximum = is_maximum && scores(y, x) > scores(y + v, x + u);
      const auto top = [&](float before, float after) {
        return 0.5F * (before - after) / (before - 2 * static_cast<float>(scores(y, x)) + after);
      };
      if (is_maximum)
        corners.push_back(
            {x, y, static_cast<uint8_t>(scores(y, x)),
             top(static_cast<float>(scores(y, x - 1)), static_cast<float>(scores(y, x + 1))),
             top(static_cast<float>(scores(y - 1, x)), static_cast<float>(scores(y + 1, x)))});
    }
  return corners;
}

double PlainBlur(const cv::Mat& image, int x, int y) {
  constexpr int kWeights[4] = {56, 48, 34, 18};
  double sum = 0;
  for (int v = -3; v <= 3; ++v)
    for (int u = -3; u <= 3; ++u)
      sum += kWeights[std::abs(u)] * kWeights[std::abs(v)] *
             image.at<uint8_t>(cv::borderInterpolate(y + v, image.rows, cv::BORDER_REFLECT_101),
                               cv::borderInterpolate(x + u, image.cols, cv::BORDER_REFLECT_101));
  return sum / 65536;
}

// Every instruction set of this processor.
class OrbKernels : public testing::TestWithParam<int64_t> {
 protected:
  void SetUp() override {
    hwy::SetSupportedTargetsForTest(GetParam());
    hwy::GetChosenTarget().DeInit();
  }
  void TearDown() override {
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
  }
};

std::vector<int64_t> Targets() {
  std::vector<int64_t> targets;
  for (int64_t rest = hwy::SupportedTargets() & HWY_TARGETS; rest; rest &= rest - 1)
    targets.push_back(rest & -rest);
  return targets;
}

INSTANTIATE_TEST_SUITE_P(Targets, OrbKernels, testing::ValuesIn(Targets()), [](const auto& target) {
  return std::string(hwy::TargetName(target.param));
});

TEST_P(OrbKernels, FastFindsWhatTheDefinitionFinds) {
  std::vector<uint8_t> scores;
  size_t found = 0;
  for (const cv::Mat& image : Images())
    for (const int threshold : {1, 7, 20, 90, 254}) {
      const std::vector<Corner> fast = DetectFast(View(image), static_cast<uint8_t>(threshold),
                                                  scores),
                                plain = PlainFast(image, threshold);
      ASSERT_EQ(fast.size(), plain.size()) << image.size() << " " << threshold;
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
  for (const cv::Mat& image : Images()) {
    cv::Mat blurred(image.size(), CV_8UC1, cv::Scalar(0));
    BlurGaussian7(View(image), blurred.ptr<uint8_t>(), static_cast<std::ptrdiff_t>(blurred.step));
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x)
        ASSERT_NEAR(blurred.at<uint8_t>(y, x), PlainBlur(image, x, y), 0.55) << x << " " << y;
  }
}

TEST_P(OrbKernels, MomentsAreThoseOfTheDisc) {
  for (const cv::Mat& image : Images()) {
    if (image.rows < 40) continue;
    for (int y = 19; y < image.rows - 19; y += 7)
      for (int x = 19; x < image.cols - 19; x += 5) {
        Moments plain;
        for (int v = -15; v <= 15; ++v)
          for (int u = -15; u <= 15; ++u)
            if (std::abs(u) <= DiscHalfWidths()[std::abs(v)]) {
              plain.x += u * image.at<uint8_t>(y + v, x + u);
              plain.y += v * image.at<uint8_t>(y + v, x + u);
            }
        const Moments moments =
            PatchMoments(image.ptr<uint8_t>(y) + x, static_cast<std::ptrdiff_t>(image.step));
        EXPECT_EQ(moments.x, plain.x);
        EXPECT_EQ(moments.y, plain.y);
      }
  }
}

TEST_P(OrbKernels, DescriptorsCompareTheTurnedPattern) {
  const cv::Mat image = Noise(150, 80, 9);
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
      return image.at<uint8_t>(y + turned(px * direction.sin, py * direction.cos),
                               x + turned(px * direction.cos, -py * direction.sin));
    };
    const Descriptor d =
        Describe(image.ptr<uint8_t>(y) + x, static_cast<std::ptrdiff_t>(image.step), direction);
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
