#include "oaslam/relocalization/depth_registration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "expect_input_error.h"
#include "oaslam/log.h"

namespace oaslam {
namespace {

const Camera kColour{.width = 640, .height = 480, .fx = 525, .fy = 525, .cx = 320, .cy = 240};
const Camera kDepth{.width = 640, .height = 480, .fx = 585, .fy = 585, .cx = 320, .cy = 240};

DepthImage Wall(double metres, cv::Size size = {640, 480}) {
  DepthImage depth;
  depth.image = cv::Mat(size, CV_16UC1, cv::Scalar(std::round(1000 * metres)));
  return depth;
}

TEST(DepthRegistrationTest, RegisteredDepthMayHaveOtherPixels) {
  DepthImage depth = Wall(2, {256, 192});
  depth.image.at<uint16_t>(96, 64) = 0;
  DepthRegistration registration;
  const auto map = registration.Register(depth, kColour);
  ASSERT_TRUE(map->At({400, 200}));
  EXPECT_NEAR(map->At({400, 200})->z, 2, 1e-6);
  EXPECT_NEAR(map->At({400, 200})->sigma, .002 + .002 * 4, 1e-6);
  EXPECT_FALSE(map->At({64.5 * 2.5 - .5, 96.5 * 2.5 - .5}));  // not measured
  EXPECT_FALSE(map->At({-5, 10}));
  depth.image = cv::Mat(1440, 1920, CV_32FC1, cv::Scalar(1.5F));  // metres, and larger
  EXPECT_NEAR(registration.Register(depth, kColour)->At({600, 30})->z, 1.5, 1e-6);
}

TEST(DepthRegistrationTest, WhatIsOutOfRangeOrAtAnEdgeIsNotKnown) {
  DepthImage depth = Wall(2);
  depth.image.colRange(0, 320) = 3000;
  depth.image.rowRange(400, 480) = 65535;
  const auto map = DepthRegistration().Register(depth, kColour);
  EXPECT_NEAR(map->At({300, 100})->z, 3, 1e-6);
  EXPECT_FALSE(map->At({320, 100}));
  EXPECT_NEAR(map->At({340, 100})->z, 2, 1e-6);
  EXPECT_FALSE(map->At({340, 440}));
}

// A near plate before a wall, as a depth camera beside the colour camera sees both.
TEST(DepthRegistrationTest, AnotherCamerasDepthIsMovedToTheImage) {
  DepthImage depth = Wall(4);
  depth.camera = kDepth;
  depth.cam_from_depth.translation.x() = -.05;  // the depth camera is to the left
  const double near = 1;
  depth.image(cv::Rect(300, 200, 100, 80)) = std::round(1000 * near);
  const auto map = DepthRegistration().Register(depth, kColour);
  const auto x_of = [&](double x, double z) {
    return kColour.fx * ((x - kDepth.cx) / kDepth.fx - .05 / z) + kColour.cx;
  };
  EXPECT_NEAR(map->At({x_of(306, near), 240})->z, near, 1e-3);
  EXPECT_NEAR(map->At({x_of(394, near), 240})->z, near, 1e-3);
  ASSERT_TRUE(map->At({x_of(268, 4), 240}));
  EXPECT_NEAR(map->At({x_of(268, 4), 240})->z, 4, 1e-3);
  ASSERT_TRUE(map->At({x_of(290, 4), 240}));
  EXPECT_NEAR(map->At({x_of(290, 4), 240})->z, near, 1e-3);  // the plate covers the wall there
  EXPECT_FALSE(map->At({x_of(401, near) + 4, 240}));  // behind it, which the depth camera saw not
  int holes = 0;
  for (int y = 100; y < 380; ++y)
    for (int x = 100; x < 240; ++x) holes += !map->At({x, y});
  EXPECT_EQ(holes, 0);
}

TEST(DepthRegistrationTest, WhatIsWrongIsSaid) {
  const auto check = [](const DepthImage& depth) { CheckDepth(depth, kColour); };
  DepthImage depth = Wall(2);
  EXPECT_NO_THROW(check(depth));
  depth.image = cv::Mat(480, 640, CV_8UC1);
  EXPECT_INPUT_ERROR(check(depth),
                     testing::HasSubstr("depth: image is neither of 16 bit unsigned"));
  depth = Wall(2, {640, 360});
  EXPECT_INPUT_ERROR(
      check(depth),
      testing::HasSubstr("640x360 pixels has another shape than the camera's, 640x480"));
  depth.camera = kDepth;
  EXPECT_INPUT_ERROR(
      check(depth),
      testing::HasSubstr("640x360 pixels, the depth camera's calibration is for 640x480"));
  depth = Wall(2);
  depth.unit = 1000;
  EXPECT_INPUT_ERROR(check(depth), testing::HasSubstr("unit 1000 m, allowed: above 0 to 1"));
  depth = Wall(2);
  depth.model.nearest = 9;
  EXPECT_INPUT_ERROR(check(depth), testing::HasSubstr("range 9 to 8 m"));
  depth.model = {.floor = -1};
  EXPECT_INPUT_ERROR(check(depth), testing::HasSubstr("noise -1 m"));
}

TEST(DepthRegistrationTest, AWrongUnitIsSaidOnce) {
  std::vector<std::string> said;
  SetLogSink([&](LogLevel, const std::string& text) { said.push_back(text); });
  DepthRegistration registration;
  DepthImage depth = Wall(2);
  for (int i = 0; i < 30; ++i) registration.Register(depth, kColour);
  EXPECT_TRUE(said.empty());
  depth.unit = 1;
  for (int i = 0; i < 30; ++i) registration.Register(depth, kColour);
  SetLogSink({});
  ASSERT_EQ(said.size(), 1);
  EXPECT_NE(said.front().find("the median is 2000 m: its unit is probably wrong (1 m)"),
            std::string::npos)
      << said.front();
}

}  // namespace
}  // namespace oaslam
