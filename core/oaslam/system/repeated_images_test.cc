#include "oaslam/system/repeated_images.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(RepeatedImages, TellsForHowLongAnImageHasBeenTheSame) {
  RepeatedImages images;
  cv::Mat image(8, 10, CV_8UC1, cv::Scalar(7));
  EXPECT_EQ(images.Add(image, 1), 0);
  EXPECT_DOUBLE_EQ(images.Add(image.clone(), 1.5), 0.5);
  EXPECT_DOUBLE_EQ(images.Add(image, 3), 2);
  image.at<uint8_t>(7, 9) = 8;
  EXPECT_EQ(images.Add(image, 4), 0);
  EXPECT_DOUBLE_EQ(images.Add(image, 5), 1);
  EXPECT_EQ(images.Add(image.rowRange(0, 4), 6), 0);
}

}  // namespace
}  // namespace oaslam
