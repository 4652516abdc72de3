#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "expect_input_error.h"
#include "oaslam/log.h"
#include "oaslam/slam.h"

namespace oaslam {
namespace {

TEST(SlamMask, IsCheckedBeforeItIsUsed) {
  Slam slam(SlamConfig::Offline(),
            {.width = 64, .height = 48, .fx = 60, .fy = 60, .cx = 31.5, .cy = 23.5});
  cv::Mat mask(48, 64, CV_8UC1, cv::Scalar(255));
  mask.rowRange(40, 48).setTo(0);
  EXPECT_NO_THROW(slam.SetMask(mask));
  EXPECT_NO_THROW(slam.SetMask({}));
  EXPECT_INPUT_ERROR(slam.SetMask(cv::Mat(24, 32, CV_8UC1, cv::Scalar(255))), HasSubstr("32x24"));
  EXPECT_INPUT_ERROR(slam.SetMask(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(255))),
                     HasSubstr("grey"));
  EXPECT_INPUT_ERROR(slam.SetMask(cv::Mat::zeros(48, 64, CV_8UC1)), HasSubstr("whole image"));
}

// Noise in squares of six pixels; its lower part stays where it is, as a bonnet does.
cv::Mat FromABonnet(double time_s) {
  cv::Mat image(240, 320, CV_8UC1);
  const int look_x = 2000 + static_cast<int>(std::lround(40 * std::sin(time_s))),
            look_y = 2000 + static_cast<int>(std::lround(30 * std::sin(1.5 * time_s)));
  const auto square = [](int x, int y) {
    const auto mixed = static_cast<uint32_t>(x / 6 * 73856093 ^ y / 6 * 19349663);
    return static_cast<uchar>(20 + (mixed * 2654435761U >> 24) % 216);
  };
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<uchar>(y, x) = y >= 180 ? square(x + 9000, y) : square(look_x + x, look_y + y);
  return image;
}

TEST(SlamMask, WhatMovesWithTheCameraIsFoundAgainAfterAReset) {
  int found = 0;
  SetLogSink([&](LogLevel, const std::string& message) {
    found += message.find("moves with the camera") != std::string::npos;
  });
  SlamConfig config = SlamConfig::Offline();
  config.runner.mode = RunnerMode::kSequential;
  Slam slam(config, {.width = 320, .height = 240, .fx = 300, .fy = 300, .cx = 159.5, .cy = 119.5});
  const auto watch = [&] {
    for (int i = 0; i < 80; ++i)
      slam.Process({.image = FromABonnet(i / 10.0), .timestamp = i / 10.0});
  };
  watch();
  EXPECT_EQ(found, 1);
  slam.Reset();
  watch();  // its times begin again
  EXPECT_EQ(found, 2);
  SetLogSink(nullptr);
}

}  // namespace
}  // namespace oaslam
