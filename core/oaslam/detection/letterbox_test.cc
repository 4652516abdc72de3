#include "oaslam/detection/letterbox.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(Letterbox, PadsRightAndBottom) {
  const cv::Mat image(480, 640, CV_8UC3, cv::Scalar(1, 2, 3));
  const Letterbox letterbox = MakeLetterbox(image, {416, 416}, Fit::kTopLeft);
  EXPECT_EQ(letterbox.image.size(), cv::Size(416, 416));
  EXPECT_EQ(letterbox.image.at<cv::Vec3b>(311, 415), cv::Vec3b(1, 2, 3));
  EXPECT_EQ(letterbox.image.at<cv::Vec3b>(312, 0), cv::Vec3b(114, 114, 114));
}

TEST(Letterbox, PadsBothSides) {
  const cv::Mat image(640, 480, CV_8UC3, cv::Scalar(1, 2, 3));
  const Letterbox letterbox = MakeLetterbox(image, {416, 416}, Fit::kCentered);
  EXPECT_EQ(letterbox.image.at<cv::Vec3b>(0, 51), cv::Vec3b(114, 114, 114));
  EXPECT_EQ(letterbox.image.at<cv::Vec3b>(0, 52), cv::Vec3b(1, 2, 3));
  EXPECT_EQ(letterbox.image.at<cv::Vec3b>(0, 363), cv::Vec3b(1, 2, 3));
  EXPECT_EQ(letterbox.image.at<cv::Vec3b>(0, 364), cv::Vec3b(114, 114, 114));
}

TEST(Letterbox, AStretchedImageFillsTheInput) {
  const cv::Mat image(480, 640, CV_8UC3, cv::Scalar(1, 2, 3));
  const Letterbox letterbox = MakeLetterbox(image, {416, 416}, Fit::kStretched);
  EXPECT_EQ(letterbox.image.size(), cv::Size(416, 416));
  EXPECT_EQ(letterbox.image.at<cv::Vec3b>(415, 415), cv::Vec3b(1, 2, 3));
}

TEST(Letterbox, BoxesComeBack) {
  const cv::Mat image(480, 640, CV_8UC3, cv::Scalar(1, 2, 3));
  for (const Fit fit : {Fit::kTopLeft, Fit::kCentered, Fit::kStretched}) {
    const Letterbox letterbox = MakeLetterbox(image, {416, 416}, fit);
    const Box original{100, 50, 300, 200};
    const Box inside{original.x1 * letterbox.scale_x + letterbox.left,
                     original.y1 * letterbox.scale_y + letterbox.top,
                     original.x2 * letterbox.scale_x + letterbox.left,
                     original.y2 * letterbox.scale_y + letterbox.top};
    const Box back = FromLetterbox(letterbox, inside, image.size());
    EXPECT_NEAR(back.x1, original.x1, 1e-9);
    EXPECT_NEAR(back.y1, original.y1, 1e-9);
    EXPECT_NEAR(back.x2, original.x2, 1e-9);
    EXPECT_NEAR(back.y2, original.y2, 1e-9);
    EXPECT_EQ(FromLetterbox(letterbox, {-50, -50, 900, 900}, image.size()), (Box{0, 0, 640, 480}));
  }
}

}  // namespace
}  // namespace oaslam
