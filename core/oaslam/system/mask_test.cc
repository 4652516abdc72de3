#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "expect_input_error.h"
#include "oaslam/slam.h"

namespace oaslam {
namespace {

TEST(SlamMask, IsCheckedBeforeItIsUsed) {
  Slam slam({}, {.width = 64, .height = 48, .fx = 60, .fy = 60, .cx = 31.5, .cy = 23.5});
  cv::Mat mask(48, 64, CV_8UC1, cv::Scalar(255));
  mask.rowRange(40, 48).setTo(0);
  EXPECT_NO_THROW(slam.SetMask(mask));
  EXPECT_NO_THROW(slam.SetMask({}));
  EXPECT_INPUT_ERROR(slam.SetMask(cv::Mat(24, 32, CV_8UC1, cv::Scalar(255))), HasSubstr("32x24"));
  EXPECT_INPUT_ERROR(slam.SetMask(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(255))),
                     HasSubstr("grey"));
  EXPECT_INPUT_ERROR(slam.SetMask(cv::Mat::zeros(48, 64, CV_8UC1)), HasSubstr("whole image"));
}

}  // namespace
}  // namespace oaslam
