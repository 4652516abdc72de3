#include "oaslam/features/resize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "grey_scene.h"
#include "instruction_sets.h"

namespace oaslam {
namespace {

struct Sizes {
  int width, height, resized_width, resized_height;
};
// Down by less and by more than 2, and up; no multiples of any vector.
constexpr Sizes kSizes[] = {{640, 480, 533, 400}, {77, 41, 64, 34},  {131, 64, 70, 33},
                            {203, 90, 61, 19},    {40, 30, 80, 60},  {16, 16, 37, 16},
                            {99, 50, 16, 16},     {101, 55, 101, 55}};

// The pixel before and the weight of the pixel behind the place of pixel i, in 1/2048.
std::pair<int, int> PlainPlace(int i, int resized_size, int size) {
  const auto place = std::clamp(static_cast<float>((i + 0.5) * size / resized_size - 0.5), 0.F,
                                static_cast<float>(size - 1));
  const int before = std::min(static_cast<int>(place), size - 2);
  return {before, static_cast<int>(std::lrint((place - static_cast<float>(before)) * 2048))};
}

int PlainLinear(const GreyImage& image, const Sizes& s, int x, int y) {
  const auto [left, right_weight] = PlainPlace(x, s.resized_width, s.width);
  const auto [top, bottom_weight] = PlainPlace(y, s.resized_height, s.height);
  const auto in_row = [&, left = left, weight = right_weight](int row) {
    return ((2048 - weight) * image.Row(row)[left] + weight * image.Row(row)[left + 1]) / 16;
  };
  return ((2048 - bottom_weight) * in_row(top) / 65536 + bottom_weight * in_row(top + 1) / 65536 +
          2) /
         4;
}

class Resize : public EveryInstructionSet {};
INSTANTIATE_TEST_SUITE_P(Targets, Resize, testing::ValuesIn(InstructionSets()),
                         NameOfInstructionSet);

TEST_P(Resize, LinearTakesTheWeightsOfTheDefinition) {
  for (const Sizes& s : kSizes) {
    const GreyBuffer image = synthetic::Noise(s.width, s.height, 1);
    GreyBuffer resized(s.resized_width, s.resized_height, 3);
    ResizeLinear(image.view(), resized);
    for (int y = 0; y < s.resized_height; ++y)
      for (int x = 0; x < s.resized_width; ++x)
        ASSERT_EQ(resized.Row(y)[x], PlainLinear(image.view(), s, x, y))
            << s.width << ": " << x << " " << y;
    EXPECT_EQ(resized.Row(5)[s.resized_width], 0) << "written beyond the edge";
  }
}

TEST_P(Resize, LinearDoesNotMoveTheImage) {
  const GreyBuffer plane = synthetic::Drawn(90, 60, [](int x, int y) { return x + 2 * y; });
  GreyBuffer resized(70, 41);
  ResizeLinear(plane.view(), resized);
  for (int y = 0; y < 41; ++y)
    for (int x = 0; x < 70; ++x)
      ASSERT_NEAR(resized.Row(y)[x], (x + 0.5) * 90 / 70 - 0.5 + 2 * ((y + 0.5) * 60 / 41 - 0.5),
                  1);
}

// The share of pixel i of an image that pixel j of the resized one covers.
double CoveredShare(int i, int j, double scale) {
  return std::max(0.0, std::min(i + 1.0, (j + 1) * scale) - std::max<double>(i, j * scale));
}

TEST(ResizeByArea, GivesTheMeanOfTheCoveredPixels) {
  for (const Sizes& s :
       {Sizes{100, 80, 37, 41}, {64, 48, 32, 16}, {50, 31, 49, 31}, {9, 7, 1, 1}}) {
    const GreyBuffer image = synthetic::Noise(s.width, s.height, 2);
    GreyBuffer resized(s.resized_width, s.resized_height);
    ResizeByArea(image.view(), resized);
    const double scale_x = static_cast<double>(s.width) / s.resized_width,
                 scale_y = static_cast<double>(s.height) / s.resized_height;
    for (int y = 0; y < s.resized_height; ++y)
      for (int x = 0; x < s.resized_width; ++x) {
        double sum = 0;
        for (int v = 0; v < s.height; ++v)
          for (int u = 0; u < s.width; ++u)
            sum += CoveredShare(u, x, scale_x) * CoveredShare(v, y, scale_y) * image.Row(v)[u];
        ASSERT_NEAR(resized.Row(y)[x], sum / (scale_x * scale_y), 0.501) << x << " " << y;
      }
  }
}

// Keys' kernel with the slope -3/4, by the distance.
double KeysWeight(double distance) {
  constexpr double a = -0.75;
  const double d = std::abs(distance);
  if (d <= 1) return (a + 2) * d * d * d - (a + 3) * d * d + 1;
  return d < 2 ? a * (d * d * d - 5 * d * d + 8 * d - 4) : 0;
}

TEST(ResizeCubic, WeighsSixteenPixelsByTheirDistance) {
  for (const Sizes& s : {Sizes{40, 30, 80, 60}, {33, 47, 50, 61}}) {
    const GreyBuffer image = synthetic::Noise(s.width, s.height, 3);
    GreyBuffer resized(s.resized_width, s.resized_height);
    ResizeCubic(image.view(), resized);
    for (int y = 4; y < s.resized_height - 4; ++y)  // within the edges, where pixels are missing
      for (int x = 4; x < s.resized_width - 4; ++x) {
        const double px = (x + 0.5) * s.width / s.resized_width - 0.5,
                     py = (y + 0.5) * s.height / s.resized_height - 0.5;
        double sum = 0;
        for (int v = 0; v < s.height; ++v)
          for (int u = 0; u < s.width; ++u)
            sum += KeysWeight(u - px) * KeysWeight(v - py) * image.Row(v)[u];
        // Places are known to 1/2048 of a pixel.
        ASSERT_NEAR(resized.Row(y)[x], std::clamp(sum, 0.0, 255.0), 0.8) << x << " " << y;
      }
  }
}

TEST(ResizeCubic, AnEvenImageStaysEvenUpToItsEdges) {
  const GreyBuffer even = synthetic::Drawn(40, 30, [](int, int) { return 200; });
  GreyBuffer resized(77, 59);
  ResizeCubic(even.view(), resized);
  for (int y = 0; y < 59; ++y)
    for (int x = 0; x < 77; ++x) ASSERT_EQ(resized.Row(y)[x], 200);
}

TEST(ResizeByArea, AWhiteImageStaysWhite) {
  const GreyBuffer white = synthetic::Drawn(1921, 1083, [](int, int) { return 255; });
  GreyBuffer resized(739, 417);
  ResizeByArea(white.view(), resized);
  for (int y = 0; y < 417; ++y)
    for (int x = 0; x < 739; ++x) ASSERT_EQ(resized.Row(y)[x], 255);
}

}  // namespace
}  // namespace oaslam
