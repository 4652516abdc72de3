#include "oaslam/images/ros_pixels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "oaslam/error.h"

namespace oaslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr uint32_t kWidth = 8, kHeight = 6, kPadding = 3;

// Rows that repeat these bytes, each with a few more behind it.
ByteBuffer Rows(uint32_t rows, uint32_t used, const ByteBuffer& even, const ByteBuffer& odd) {
  ByteBuffer bytes;
  for (uint32_t y = 0; y < rows; ++y) {
    const ByteBuffer& row = y % 2 == 0 ? even : odd;
    for (uint32_t x = 0; x < used; ++x) bytes.push_back(row[x % row.size()]);
    bytes.insert(bytes.end(), kPadding, 0xee);
  }
  return bytes;
}

RosImage ImageOf(const std::string& encoding, uint32_t used, const ByteBuffer& bytes) {
  return {.height = kHeight,
          .width = kWidth,
          .step = used + kPadding,
          .encoding = encoding,
          .data = bytes};
}

// Red, of which green is a half: BGR (0, 100, 200), grey 118.
TEST(RosPixels, OfEveryEncoding) {
  struct Case {
    const char* encoding;
    uint32_t used;  // bytes of a row
    ByteBuffer even, odd;
  };
  const ByteBuffer red_green = {200, 100}, green_blue = {100, 0}, green_red = {100, 200},
                   blue_green = {0, 100};
  const std::vector<Case> cases = {{"rgb8", 24, {200, 100, 0}, {200, 100, 0}},
                                   {"bgr8", 24, {0, 100, 200}, {0, 100, 200}},
                                   {"8UC3", 24, {0, 100, 200}, {0, 100, 200}},
                                   {"rgba8", 32, {200, 100, 0, 9}, {200, 100, 0, 9}},
                                   {"bgra8", 32, {0, 100, 200, 9}, {0, 100, 200, 9}},
                                   {"bayer_rggb8", 8, red_green, green_blue},
                                   {"bayer_bggr8", 8, blue_green, green_red},
                                   {"bayer_gbrg8", 8, {100, 0}, {200, 100}},
                                   {"bayer_grbg8", 8, green_red, blue_green}};
  for (const Case& one : cases) {
    const ByteBuffer bytes = Rows(kHeight, one.used, one.even, one.odd);
    const cv::Mat color = PixelsOf(ImageOf(one.encoding, one.used, bytes), true, 16);
    ASSERT_EQ(color.size(), cv::Size(kWidth, kHeight));
    EXPECT_EQ(color.at<cv::Vec3b>(3, 3), cv::Vec3b(0, 100, 200)) << one.encoding;
    const cv::Mat grey = PixelsOf(ImageOf(one.encoding, one.used, bytes), false, 16);
    EXPECT_NEAR(grey.at<uint8_t>(3, 3), 0.299 * 200 + 0.587 * 100, 1) << one.encoding;
  }
}

TEST(RosPixels, OfGreyAndYuv) {
  for (const char* name : {"mono8", "8UC1"}) {
    const ByteBuffer bytes = Rows(kHeight, 8, {118}, {118});
    EXPECT_EQ(PixelsOf(ImageOf(name, 8, bytes), false, 16).at<uint8_t>(5, 7), 118);
    EXPECT_EQ(PixelsOf(ImageOf(name, 8, bytes), true, 16).at<cv::Vec3b>(5, 7)[2], 118);
  }
  // Y 118; U and V without colour.
  for (const char* name : {"uyvy", "yuv422"}) {
    const ByteBuffer bytes = Rows(kHeight, 16, {128, 118}, {128, 118});
    EXPECT_EQ(PixelsOf(ImageOf(name, 16, bytes), false, 16).at<uint8_t>(5, 7), 118);
  }
  for (const char* name : {"yuyv", "yuv422_yuy2"}) {
    const ByteBuffer bytes = Rows(kHeight, 16, {118, 128}, {118, 128});
    EXPECT_EQ(PixelsOf(ImageOf(name, 16, bytes), false, 16).at<uint8_t>(5, 7), 118);
  }
  const ByteBuffer nv21 = Rows(kHeight * 3 / 2, 8, {118}, {118});
  const cv::Mat grey = PixelsOf(ImageOf("nv21", 8, nv21), false, 16);
  EXPECT_EQ(grey.size(), cv::Size(kWidth, kHeight));
  EXPECT_EQ(grey.at<uint8_t>(5, 7), 118);
}

TEST(RosPixels, OfSixteenBits) {
  ByteBuffer bytes = Rows(kHeight, 16, {0x34, 0x02}, {0x34, 0x02});
  RosImage image = ImageOf("mono16", 16, bytes);
  EXPECT_EQ(PixelsOf(image, false, 10).at<uint8_t>(2, 2), 0x234 >> 2);
  bytes = Rows(kHeight, 16, {0x02, 0x34}, {0x02, 0x34});
  image.is_big_endian = true;
  image.data = bytes;
  EXPECT_EQ(PixelsOf(image, false, 10).at<uint8_t>(2, 2), 0x234 >> 2);
  image.encoding = "16UC1";
  EXPECT_EQ(ValuesOf(image).at<uint16_t>(2, 2), 0x234);
}

TEST(RosPixels, RefuseWhatTheyAreNot) {
  const ByteBuffer bytes = Rows(kHeight, 8, {1}, {2});
  const auto refusal = [](const RosImage& image) -> std::string {
    try {
      PixelsOf(image, false, 16);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(ImageOf("32FC1", 8, bytes)),
              AllOf(HasSubstr("\"32FC1\""), HasSubstr("bayer_rggb8")));
  EXPECT_THAT(refusal(ImageOf("rgb8", 24, bytes)), HasSubstr("8 x 6 pixels of rgb8"));
  RosImage image = ImageOf("mono8", 8, bytes);
  image.height = 1 << 30;
  EXPECT_THAT(refusal(image), HasSubstr("do not have"));
  image.height = 5;
  image.step = 1u << 31;
  EXPECT_THAT(refusal(image), HasSubstr("do not have"));
}

TEST(RosPixels, OfCompressedImages) {
  std::vector<uint8_t> png;
  cv::imencode(".png", cv::Mat(4, 5, CV_8UC1, cv::Scalar(77)), png);
  RosCompressedImage image{.format = "mono8; png compressed ", .data = png};
  EXPECT_EQ(PixelsOf(image, false).at<uint8_t>(3, 4), 77);
  EXPECT_EQ(PixelsOf(image, true).channels(), 3);
  image.data = ByteView(png).first(20);
  EXPECT_TRUE(PixelsOf(image, false).empty());
  image.format = "16UC1; compressedDepth png";
  EXPECT_THROW(PixelsOf(image, false), InputError);
}

}  // namespace
}  // namespace oaslam
