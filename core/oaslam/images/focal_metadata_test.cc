#include "oaslam/images/focal_metadata.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "exif_jpeg.h"
#include "ffmpeg.h"
#include "folder_test.h"
#include "oaslam/image_source.h"

namespace oaslam {
namespace {

const cv::Mat kImage(48, 64, CV_8UC3, cv::Scalar::all(90));

struct FocalLength35mmTest : FolderTest {};

TEST_F(FocalLength35mmTest, OfAnImageInEitherByteOrder) {
  for (const bool big_endian : {false, true}) {
    const std::string path = folder.Write(
        "a.jpg", JpegWithExif(kImage, {.focal_length_35mm = 26, .big_endian = big_endian}));
    EXPECT_EQ(FocalLength35mm(path), 26);
  }
}

TEST_F(FocalLength35mmTest, OfAFolderOrAListThatOfItsFirstImage) {
  folder.Write("images/2.jpg", JpegWithExif(kImage, {.focal_length_35mm = 24}));
  folder.Write("images/10.jpg", JpegWithExif(kImage, {.focal_length_35mm = 77}));
  EXPECT_EQ(FocalLength35mm(folder / "images"), 24);
  EXPECT_EQ(FocalLength35mm(folder.Write("list.txt", "images/10.jpg\nimages/2.jpg\n")), 77);
}

TEST_F(FocalLength35mmTest, OfAVideoThatOfItsContainer) {
  OASLAM_SKIP_WITHOUT_ENCODER("mpeg4");
  const std::string source = "-f lavfi -i testsrc=size=160x120:rate=30:duration=0.2 -c:v mpeg4 ";
  ASSERT_TRUE(RunFfmpeg(source +
                        "-movflags use_metadata_tags "
                        "-metadata com.apple.quicktime.camera.focal_length.35mm_equivalent=26 " +
                        folder / "a.mov"));
  EXPECT_EQ(FocalLength35mm(folder / "a.mov"), 26);
  ASSERT_TRUE(RunFfmpeg(source + folder / "b.mov"));
  EXPECT_FALSE(FocalLength35mm(folder / "b.mov"));
}

TEST_F(FocalLength35mmTest, NothingWhereNothingIsStated) {
  EXPECT_FALSE(
      FocalLength35mm(folder.Write("unknown.jpg", JpegWithExif(kImage, {.focal_length_35mm = 0}))));
  EXPECT_FALSE(
      FocalLength35mm(folder.Write("wrong.jpg", JpegWithExif(kImage, {.focal_length_35mm = 1}))));
  const std::string whole = JpegWithExif(kImage, {.focal_length_35mm = 26});
  for (size_t length = 0; length < 90; ++length)  // ends within the metadata
    EXPECT_EQ(FocalLength35mm(folder.Write("cut.jpg", whole.substr(0, length))).value_or(26), 26)
        << length;
  EXPECT_FALSE(FocalLength35mm(folder.Write("plain.pgm", "P5\n1 1\n255\n1")));
  EXPECT_FALSE(FocalLength35mm(folder.Write("noise.mp4", std::string("\0\1\2\3", 4))));
  std::filesystem::create_directory(folder / "empty");
  EXPECT_FALSE(FocalLength35mm(folder / "empty"));
  EXPECT_FALSE(FocalLength35mm(folder / "nowhere"));
  EXPECT_FALSE(FocalLength35mm("webcam:0"));
}

TEST_F(FocalLength35mmTest, RefersToTheDiagonal) {
  EXPECT_DOUBLE_EQ(kFrameDiagonal35mm, std::hypot(36.0, 24.0));
}

}  // namespace
}  // namespace oaslam
