#include <libheif/heif.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "exif_jpeg.h"
#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/image_source.h"
#include "oaslam/images/bit_depth.h"
#include "oaslam/images/exif_orientation.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/sensor_data.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// A photo of 96 x 64 pixels, red at the left, which is turned clockwise to be upright; false where
// this system has no encoder for it.
bool WriteHeif(const std::string& path, heif_compression_format format, const std::string& exif) {
  heif_context* context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  heif_image* image = nullptr;
  heif_image_create(96, 64, heif_colorspace_RGB, heif_chroma_interleaved_RGB, &image);
  heif_image_add_plane(image, heif_channel_interleaved, 96, 64, 8);
  int stride = 0;
  uint8_t* data = heif_image_get_plane(image, heif_channel_interleaved, &stride);
  cv::Mat rgb(64, 96, CV_8UC3, data, static_cast<size_t>(stride));
  rgb.setTo(cv::Scalar(40, 40, 40));
  rgb(cv::Rect(0, 0, 48, 64)).setTo(cv::Scalar(200, 100, 50));
  heif_encoding_options* options = heif_encoding_options_alloc();
  options->image_orientation = heif_orientation_rotate_90_cw;
  heif_image_handle* handle = nullptr;
  const bool is_made =
      heif_context_get_encoder_for_format(context, format, &encoder).code == 0 &&
      heif_context_encode_image(context, image, encoder, options, &handle).code == 0 &&
      heif_context_add_exif_metadata(context, handle, exif.data(), static_cast<int>(exif.size()))
              .code == 0 &&
      heif_context_write_to_file(context, path.c_str()).code == 0;
  if (handle) heif_image_handle_release(handle);
  if (encoder) heif_encoder_release(encoder);
  heif_encoding_options_free(options);
  heif_image_release(image);
  heif_context_free(context);
  return is_made;
}

class HeifPhotos : public testing::TestWithParam<std::pair<const char*, heif_compression_format>> {
 protected:
  // Skips where there is no encoder.
  void SetUp() override {
    const std::string jpeg = JpegWithExif(cv::Mat(8, 8, CV_8UC1, cv::Scalar(9)),
                                          {.orientation = 6, .focal_length_35mm = 26});
    // The EXIF block without "Exif\0\0", which begins at its TIFF header.
    const std::string exif = jpeg.substr(jpeg.find("Exif") + 6, 64);
    path_ = folder_ / GetParam().first;
    if (!WriteHeif(path_, GetParam().second, exif)) GTEST_SKIP() << "libheif has no encoder here";
  }

  TempFolder folder_;
  std::string path_;
};

TEST_P(HeifPhotos, AreReadAsStoredOrUpright) {
  const auto image = OpenImages(path_, {.color = true})->Next();
  ASSERT_TRUE(image);
  ASSERT_EQ(image->image.size(), cv::Size(96, 64));
  const cv::Vec3b left = image->image.at<cv::Vec3b>(32, 20);
  EXPECT_NEAR(left[0], 50, 8);
  EXPECT_NEAR(left[2], 200, 8);
  EXPECT_EQ(ReadImage(path_, false).type(), CV_8UC1);
  // A folder is read in colour, too, and the left is at the top once it is turned clockwise.
  const auto turned =
      OpenImages(folder_.path(), {.color = true, .orientation = Orientation::kUpright})->Next();
  ASSERT_TRUE(turned);
  ASSERT_EQ(turned->image.size(), cv::Size(64, 96));
  EXPECT_NEAR(turned->image.at<cv::Vec3b>(20, 32)[2], 200, 8);
  EXPECT_NEAR(turned->image.at<cv::Vec3b>(76, 32)[2], 40, 8);
}

TEST_P(HeifPhotos, HaveTheirMetadata) {
  EXPECT_EQ(FocalLength35mm(path_), 26);
  EXPECT_EQ(FocalLength35mm(folder_.path()), 26);
  EXPECT_EQ(ExifTurn(path_), 1);
}

TEST_P(HeifPhotos, ThatAreDamagedCountAsUnreadable) {
  const std::string bytes = folder_.Read(GetParam().first);
  for (const size_t length : {bytes.size() / 8, bytes.size() / 2, bytes.size() - 40}) {
    folder_.Write(GetParam().first, bytes.substr(0, length));
    const auto image = OpenImages(folder_.path(), {})->Next();
    ASSERT_TRUE(image) << length;
    EXPECT_TRUE(length > bytes.size() / 2 || image->image.empty()) << length;
    EXPECT_NO_THROW(FocalLength35mm(path_));
    EXPECT_NO_THROW(ExifTurn(path_));
  }
}

INSTANTIATE_TEST_SUITE_P(Both, HeifPhotos,
                         testing::Values(std::pair("a.heic", heif_compression_HEVC),
                                         std::pair("a.avif", heif_compression_AV1)));

// The first grey value of each of the images, and what was said.
std::pair<std::vector<int>, std::vector<std::string>> GreyOf(
    const std::string& source, const ImageSourceOptions& options = {}) {
  std::pair<std::vector<int>, std::vector<std::string>> result;
  SetLogSink([&](LogLevel, const std::string& message) { result.second.push_back(message); });
  const auto images = OpenImages(source, options);
  while (const auto image = images->Next()) {
    EXPECT_EQ(image->image.type(), CV_8UC1);
    result.first.push_back(image->image.at<uint8_t>(0, 0));
  }
  SetLogSink({});
  return result;
}

// A 16-bit image with the brightest pixel in its middle.
cv::Mat Deep(int value, int brightest) {
  cv::Mat image(16, 24, CV_16UC1, cv::Scalar(value));
  image.at<uint16_t>(8, 12) = static_cast<uint16_t>(brightest);
  return image;
}

TEST(BitDepth, IsToldByAllImagesAndSaidOnce) {
  for (const char* kind : {".png", ".tiff", ".pgm"})
    for (const int bits : {10, 12, 14}) {
      const TempFolder folder;
      const int half = 1 << (bits - 1);
      // Only the last one is bright; the scale is its.
      cv::imwrite(folder / (std::string("1") + kind), Deep(half / 4, half / 2));
      cv::imwrite(folder / (std::string("2") + kind), Deep(half, 2 * half - 1));
      const auto [grey, said] = GreyOf(folder.path());
      EXPECT_THAT(grey, ElementsAre(32, 128)) << kind << bits;
      EXPECT_THAT(said, ElementsAre(HasSubstr(std::to_string(bits) + " of the 16 bits")));
      // Parts of a recording are read alike.
      EXPECT_THAT(GreyOf(folder.path(), {.to = 1}).first, ElementsAre(32));
      EXPECT_THAT(GreyOf(folder.path(), {.quiet = true}).second, IsEmpty());
    }
}

TEST(BitDepth, OfSixteenBitsAndOfEightNeedsNoWord) {
  const TempFolder folder;
  cv::imwrite(folder / "1.png", Deep(32768, 65535));
  auto [grey, said] = GreyOf(folder.path());
  EXPECT_THAT(grey, ElementsAre(128));
  EXPECT_THAT(said, IsEmpty());
  cv::imwrite(folder / "1.png", cv::Mat(16, 24, CV_8UC1, cv::Scalar(7)));
  EXPECT_THAT(GreyOf(folder.path()).first, ElementsAre(7));
  EXPECT_EQ(UsedBits(Deep(3, 255)), 8);
  EXPECT_EQ(UsedBits(Deep(3, 256)), 10);
}

TEST(BitDepth, OfPixelsBrighterThanTheOnesLookedAtIsKept) {
  EXPECT_EQ(InEightBits(Deep(100, 60000), 12).at<uint8_t>(8, 12), 255);
  const cv::Mat color(16, 16, CV_16UC3, cv::Scalar(4095, 2048, 16));
  EXPECT_EQ(InEightBits(color, 12).at<cv::Vec3b>(3, 3), cv::Vec3b(255, 128, 1));
}

// A scene as a sensor with the order of colours BGGR sees it.
cv::Mat Mosaic(const cv::Mat& scene) {
  cv::Mat mosaic(scene.size(), CV_8UC1);
  for (int y = 0; y < scene.rows; ++y)
    for (int x = 0; x < scene.cols; ++x)
      mosaic.at<uint8_t>(y, x) = scene.at<cv::Vec3b>(y, x)[y % 2 + x % 2];
  return mosaic;
}

struct SensorData : FolderTest {};

TEST_F(SensorData, IsRecognisedByItsPixels) {
  cv::Mat scene(120, 160, CV_8UC3), grey, noise(120, 160, CV_8UC1), deep;
  cv::randu(scene, 0, 255);
  cv::GaussianBlur(scene, scene, {}, 4);
  cv::multiply(scene, cv::Scalar(0.5, 1.2, 0.8), scene);
  cv::cvtColor(scene, grey, cv::COLOR_BGR2GRAY);
  cv::randu(noise, 0, 255);
  const cv::Mat mosaic = Mosaic(scene);
  EXPECT_TRUE(IsBayerMosaic(mosaic));
  mosaic.convertTo(deep, CV_16U, 16);
  EXPECT_TRUE(IsBayerMosaic(deep));
  EXPECT_FALSE(IsBayerMosaic(grey));
  EXPECT_FALSE(IsBayerMosaic(noise));
  cv::Mat lines(120, 160, CV_8UC1, cv::Scalar(20));  // interlaced: alike in one direction
  for (int y = 0; y < lines.rows; y += 2) lines.row(y).setTo(200);
  EXPECT_FALSE(IsBayerMosaic(lines));
  cv::imwrite(folder / "m.png", mosaic);
  for (const bool color : {false, true})
    EXPECT_INPUT_ERROR(OpenImages(folder / "m.png", {.color = color})->Next(),
                       HasSubstrs("m.png", "Bayer", "develop"));
}

TEST_F(SensorData, IsRecognisedByNames) {
  for (const char* name : {"cam/bayer_rggb8/1.png", "left_bayer_GRBG16.pgm", "bayer_bggr/a.tiff"})
    EXPECT_TRUE(IsNamedBayer(name)) << name;
  for (const char* name : {"bayern/1.png", "bayer/1.png", "bayer_leverkusen.jpg"})
    EXPECT_FALSE(IsNamedBayer(name)) << name;
  cv::imwrite(folder.Write("bayer_rggb8/1.png", ""), cv::Mat(40, 40, CV_8UC1, cv::Scalar(90)));
  EXPECT_INPUT_ERROR(OpenImages(folder / "bayer_rggb8", {})->Next(), HasSubstr("Bayer"));
  // In colour it has been developed.
  cv::imwrite(folder / "bayer_rggb8/1.png", cv::Mat(40, 40, CV_8UC3, cv::Scalar(90, 1, 1)));
  EXPECT_TRUE(OpenImages(folder / "bayer_rggb8", {})->Next());
}

TEST_F(SensorData, OfPhotosIsRefused) {
  folder.Write("IMG_1.DNG", "II*");
  const std::string list = folder.Write("list.txt", "1.5 IMG_1.DNG\n");
  for (const std::string& source : {folder.path(), folder / "IMG_1.DNG", list})
    EXPECT_INPUT_ERROR(OpenImages(source, {}), HasSubstrs("IMG_1.DNG", "develop"));
  // Beside a photo it is the same view again.
  cv::imwrite(folder / "IMG_1.JPG", cv::Mat(40, 40, CV_8UC3, cv::Scalar::all(90)));
  EXPECT_EQ(ListImages(folder.path(), {})->size(), 1U);
}

TEST_F(SensorData, OfATiffIsToldByItsTags) {
  const auto tiff = [](bool big_endian, uint16_t tag, uint16_t value) {
    std::string text = big_endian ? "MM" : "II";
    const auto put = [&](uint32_t number, int bytes) {
      for (int i = 0; i < bytes; ++i)
        text += static_cast<char>(number >> 8 * (big_endian ? bytes - 1 - i : i) & 0xff);
    };
    put(42, 2), put(8, 4), put(1, 2), put(tag, 2), put(3, 2), put(1, 4), put(value, 2), put(0, 2);
    return text;
  };
  const auto is_raw = [](const std::string& text) { return IsRawTiff({text.begin(), text.end()}); };
  for (const bool big_endian : {false, true}) {
    const std::string cfa = tiff(big_endian, 262, 32803);
    EXPECT_TRUE(is_raw(cfa));
    EXPECT_TRUE(is_raw(tiff(big_endian, 50706, 1)));
    EXPECT_FALSE(is_raw(tiff(big_endian, 262, 1)));
    for (size_t length = 0; length < 20; ++length) EXPECT_FALSE(is_raw(cfa.substr(0, length)));
  }
  const std::string path = folder.Write("a.tif", tiff(false, 262, 32803));
  EXPECT_INPUT_ERROR(OpenImages(path, {})->Next(), HasSubstrs("a.tif", "Bayer"));
  cv::imwrite(path, cv::Mat(40, 40, CV_8UC1, cv::Scalar(90)));
  EXPECT_TRUE(OpenImages(path, {})->Next());
}

}  // namespace
}  // namespace oaslam
