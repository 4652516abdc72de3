#include "oaslam/detection/view_change.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace oaslam {
namespace {

// A part of a smooth pattern, `shift` pixels to the right.
cv::Mat View(int shift) {
  static const cv::Mat pattern = [] {
    cv::Mat noise(480, 960, CV_8U), smooth;
    cv::RNG rng(4);
    rng.fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(noise, smooth, {}, 20);
    cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
    return smooth;
  }();
  return pattern(cv::Rect(shift, 0, 640, 480)).clone();
}

int CountChosen(int images, double interval_s, int pixels_an_image) {
  ViewChange change;
  int chosen = 0;
  for (int i = 0; i < images; ++i)
    chosen += change.Choose(View(i * pixels_an_image), i * interval_s);
  return chosen;
}

TEST(ViewChange, MeasuresTheShareOfTheWidth) {
  for (const int shift : {3, 6, 10})
    EXPECT_NEAR(ShareMoved(View(0), View(shift)), shift / 640.0, 0.2 * shift / 640) << shift;
  EXPECT_EQ(ShareMoved(View(5), View(5)), 0);
}

TEST(ViewChange, ABrighterImageIsTheSameView) {
  EXPECT_LT(ShareMoved(View(0), View(0) + 8), 0.002);
}

TEST(ViewChange, ChoosesTheFirstImageAndThoseThatDiffer) {
  EXPECT_EQ(CountChosen(60, 0.001, 0), 1);
  EXPECT_EQ(CountChosen(30, 0.001, 10), 30);
  const int slow = CountChosen(100, 0.001, 1);
  EXPECT_GT(slow, 10);
  EXPECT_LT(slow, 40);
}

TEST(ViewChange, ChoosesOneNowAndThenWhereNothingMoves) {
  EXPECT_EQ(CountChosen(100, 0.05, 0), 34);  // every third
}

TEST(ViewChange, TakesImagesOfOneColour) {
  ViewChange change;
  const cv::Mat black = cv::Mat::zeros(480, 640, CV_8UC3);
  EXPECT_TRUE(change.Choose(black, 0));
  EXPECT_FALSE(change.Choose(black, 0.01));
}

// Images looked at of a camera that stays lost for a time, at 30 Hz.
int CountWhileLost(double seconds, int pixels_a_tenth) {
  cv::Mat last = View(0);
  double last_s = 0;
  int count = 0;
  for (int i = 1; i <= static_cast<int>(30 * seconds); ++i) {
    const double now = i / 30.0;
    const cv::Mat image = View(static_cast<int>(10 * now) * pixels_a_tenth % 300);
    if (!HelpsLostCamera(now, now - last_s, last, image)) continue;
    last = image;
    last_s = now;
    ++count;
  }
  return count;
}

TEST(ViewChange, ALostCameraIsLookedForOftenAtFirst) {
  EXPECT_NEAR(CountWhileLost(5, 20), 50, 3);
  EXPECT_NEAR(CountWhileLost(21, 20), 50 + 32, 4);
}

TEST(ViewChange, ALostCameraThatStandsStillIsLookedForSeldom) {
  EXPECT_NEAR(CountWhileLost(5, 0), 10, 1);
  EXPECT_NEAR(CountWhileLost(20, 0), 10 + 6, 2);
}

TEST(ViewChange, ImagesOfAnotherSizeShowAnotherView) {
  EXPECT_TRUE(HelpsLostCamera(0, 0.2, View(0), View(0).rowRange(0, 240)));
}

}  // namespace
}  // namespace oaslam
