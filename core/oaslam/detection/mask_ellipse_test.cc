#include "oaslam/detection/mask_ellipse.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "oaslam/detection/letterbox.h"

namespace oaslam {
namespace {

constexpr int kRows = 80, kColumns = 120;
const cv::Size kNetwork(480, 320);  // four pixels a cell

struct Disc {
  double cx, cy, a, b, theta;  // half axes, network pixels
};

// Two prototypes: one is +1 inside of an ellipse and -1 outside, the other is constant.
cv::Mat Prototypes(const Disc& disc) {
  cv::Mat tensor(std::vector<int>{1, 2, kRows, kColumns}, CV_32F, cv::Scalar(1));
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x) {
      const double dx = 4 * (x + 0.5) - disc.cx, dy = 4 * (y + 0.5) - disc.cy,
                   c = std::cos(disc.theta), s = std::sin(disc.theta);
      const double u = (c * dx + s * dy) / disc.a, v = (-s * dx + c * dy) / disc.b;
      tensor.ptr<float>()[y * kColumns + x] = u * u + v * v < 1 ? 1.F : -1.F;
    }
  return tensor;
}

TEST(MaskEllipse, FindsTheEllipseOfAMask) {
  constexpr double kTolerance_px = 2.4;  // 0.6 of a cell: the border of a mask of cells is ragged
  for (const Disc& disc :
       {Disc{240, 160, 100, 50, 0.5}, Disc{100.5, 201.25, 80, 30, -1.2}, Disc{300, 150, 40, 39, 0},
        Disc{200, 160, 90, 60, std::numbers::pi / 2}}) {
    const auto ellipse = EllipseFromMask(Prototypes(disc), {3, 0}, {0, 0, 480, 320}, kNetwork);
    ASSERT_TRUE(ellipse);
    EXPECT_NEAR((*ellipse)[0], disc.cx, 0.5);
    EXPECT_NEAR((*ellipse)[1], disc.cy, 0.5);
    EXPECT_NEAR((*ellipse)[2], 2 * disc.a, kTolerance_px);
    EXPECT_NEAR((*ellipse)[3], 2 * disc.b, kTolerance_px);
    if (disc.a > 1.2 * disc.b) {
      EXPECT_NEAR(std::sin((*ellipse)[4] - disc.theta), 0, 0.02);
    }
    EXPECT_LE(std::abs((*ellipse)[4]), std::numbers::pi / 2 + 1e-12);
  }
}

TEST(MaskEllipse, OnlyInsideTheBox) {
  const cv::Mat prototypes = Prototypes({240, 160, 100, 50, 0});
  // All of the mask is on with the constant alone: what is left is the box.
  const auto ellipse = EllipseFromMask(prototypes, {0, 1}, {40, 80, 120, 120}, kNetwork);
  ASSERT_TRUE(ellipse);
  EXPECT_NEAR((*ellipse)[0], 80, 1e-9);
  EXPECT_NEAR((*ellipse)[1], 100, 1e-9);
  EXPECT_NEAR((*ellipse)[2], 4 * 80 / std::sqrt(12), 1e-9);  // a rectangle's standard deviation
  EXPECT_NEAR((*ellipse)[3], 4 * 40 / std::sqrt(12), 1e-9);
  EXPECT_FALSE(EllipseFromMask(prototypes, {0, -1}, {40, 80, 120, 120}, kNetwork));
  EXPECT_FALSE(EllipseFromMask(prototypes, {0, 1}, {40, 80, 46, 86}, kNetwork));  // a few cells
  EXPECT_FALSE(
      EllipseFromMask(prototypes, {0, 1}, {-900, -80, -100, -10}, kNetwork));  // beside the image
  EXPECT_FALSE(EllipseFromMask(prototypes, {std::nanf(""), 1}, {0, 0, 480, 320}, kNetwork));
}

TEST(MaskEllipse, LeavesTheLetterboxAsBoxesDo) {
  const Letterbox letterbox =
      MakeLetterbox(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(0)), {320, 320}, Fit::kCentered);
  const auto ellipse = FromLetterbox(letterbox, std::array{160.0, 160.0, 20.0, 10.0, 0.3});
  const Box box = FromLetterbox(letterbox, Box{150, 155, 170, 165}, {640, 480});
  EXPECT_DOUBLE_EQ(ellipse[0], box.Center().x());
  EXPECT_DOUBLE_EQ(ellipse[1], box.Center().y());
  EXPECT_DOUBLE_EQ(ellipse[2], box.Width());
  EXPECT_DOUBLE_EQ(ellipse[3], box.Height());
  EXPECT_DOUBLE_EQ(ellipse[4], 0.3);
}

}  // namespace
}  // namespace oaslam
