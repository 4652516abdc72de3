#include "oaslam/images/exif_orientation.h"

#include <gtest/gtest.h>

#include "exif_jpeg.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

TEST(ExifTurn, BringsThePixelsUpright) {
  const TempFolder folder;
  const cv::Mat image(8, 16, CV_8UC3, cv::Scalar(10, 20, 30));
  const auto turn_of = [&](int orientation) {
    return ExifTurn(folder.Write(
        "a.jpg", JpegWithExif(image, {.orientation = static_cast<uint16_t>(orientation)})));
  };
  EXPECT_EQ(turn_of(1), 0);
  EXPECT_EQ(turn_of(6), 1);
  EXPECT_EQ(turn_of(3), 2);
  EXPECT_EQ(turn_of(8), 3);
  EXPECT_EQ(turn_of(5), std::nullopt);  // mirrored
  EXPECT_EQ(ExifTurn(folder.Write("b.txt", "no image")), std::nullopt);
  EXPECT_EQ(ExifTurn(folder / "missing.jpg"), std::nullopt);
}

}  // namespace
}  // namespace oaslam
