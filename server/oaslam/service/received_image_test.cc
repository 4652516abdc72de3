#include "oaslam/service/received_image.h"

#include <opencv2/imgcodecs.hpp>
#include <string>

#include "expect_input_error.h"

namespace oaslam {
namespace {

std::string Encoded(const char* extension, const cv::Mat& image) {
  std::vector<uchar> bytes;
  cv::imencode(extension, image, bytes);
  return {bytes.begin(), bytes.end()};
}

TEST(ReceivedImage, IsDecodedAsItWasSent) {
  cv::Mat image(48, 64, CV_8UC3, cv::Scalar(10, 20, 200));
  for (const char* extension : {".png", ".jpg"}) {
    const std::string bytes = Encoded(extension, image);
    EXPECT_EQ(SizeOfReceivedImage(bytes), image.size());
    EXPECT_EQ(DecodeReceivedImage(bytes, ImageColor::kBgr).type(), CV_8UC3);
    const cv::Mat grey = DecodeReceivedImage(bytes, ImageColor::kGrey);
    EXPECT_EQ(grey.type(), CV_8UC1);
    EXPECT_NEAR(grey.at<uchar>(20, 20), 72, 3);
  }
}

TEST(ReceivedImage, ATextIsBase64OrTheDataUrlOfACanvas) {
  for (const char* text :
       {"Zm9vYg==", "data:image/jpeg;base64,Zm9vYg==", "DATA:image/png;name=a.png;Base64,Zm9vYg==",
        "data:;base64,Zm9vYg%3D%3D"})
    EXPECT_EQ(BytesOfImageText(text, "image"), "foob") << text;
  EXPECT_TRUE(IsDataUrl("Data:,"));
  EXPECT_FALSE(IsDataUrl("data"));
  for (const auto& [text, problem] :
       {std::pair{"data:,", "without data, as a canvas of no size gives it"},
        {"data:image/jpeg;base64,", "without data"},
        {"data:image/jpeg;base64", "without a comma"},
        {"data:image/svg+xml,<svg/>", "not of base64"},
        {"data:image/jpeg;base64,Zm9v Yg==", "damaged"},
        {"data:image/jpeg;base64,Zm9vYg%3", "damaged"},
        {"blob:http://a/b", "neither base64 nor a data: URL"}})
    EXPECT_INPUT_ERROR(BytesOfImageText(text, "images[0].image"),
                       AllOf(StartsWith("images[0].image: is "), HasSubstr(problem)))
        << text;
}

TEST(ReceivedImage, OtherFormatsAreRefusedBeforeADecoderSeesThem) {
  const auto error_of = [](const std::string& bytes) {
    return InputErrorOf([&] { SizeOfReceivedImage(bytes); });
  };
  EXPECT_THAT(error_of(""), HasSubstr("neither a JPEG nor a PNG"));
  EXPECT_THAT(error_of(Encoded(".bmp", cv::Mat::zeros(32, 32, CV_8UC1))),
              HasSubstr("neither a JPEG nor a PNG"));
}

TEST(ReceivedImage, ABombIsRefusedByItsHeader) {
  std::string png = Encoded(".png", cv::Mat::zeros(32, 32, CV_8UC1));
  png[16] = 0, png[17] = 1, png[18] = 0, png[19] = 0;  // 65536 wide
  EXPECT_INPUT_ERROR(SizeOfReceivedImage(png), HasSubstr("65536 x 32"));
  std::string jpeg = Encoded(".jpg", cv::Mat::zeros(32, 32, CV_8UC1));
  const size_t frame = jpeg.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  jpeg[frame + 5] = '\x3f', jpeg[frame + 7] = '\x3f';
  EXPECT_INPUT_ERROR(SizeOfReceivedImage(jpeg), HasSubstr("50 million"));
}

TEST(ReceivedImage, AJpegOfManyScansIsRefusedBeforeItIsDecoded) {
  std::vector<uchar> bytes;
  cv::imencode(".jpg", cv::Mat::zeros(64, 64, CV_8UC1), bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  std::string jpeg(bytes.begin(), bytes.end());
  EXPECT_EQ(DecodeReceivedImage(jpeg, ImageColor::kGrey).rows, 64);
  const size_t last = jpeg.rfind("\xff\xda"), end = jpeg.rfind("\xff\xd9");
  ASSERT_TRUE(last != std::string::npos && end != std::string::npos);
  const std::string scan = jpeg.substr(last, end - last);
  for (int i = 0; i < 200; ++i) jpeg.insert(end, scan);
  EXPECT_INPUT_ERROR(SizeOfReceivedImage(jpeg), HasSubstr("scans, allowed: 100"));
}

// Whatever is cut or changed, there is an image or an InputError.
TEST(ReceivedImage, DamageIsAnInputError) {
  for (const char* extension : {".png", ".jpg"}) {
    const std::string whole = Encoded(extension, cv::Mat::zeros(40, 40, CV_8UC3));
    for (size_t i = 0; i < whole.size(); i += 3)
      for (const bool is_cut : {true, false}) {
        std::string bytes = is_cut ? whole.substr(0, i) : whole;
        if (!is_cut) bytes[i] = static_cast<char>(~bytes[i]);
        try {
          EXPECT_FALSE(DecodeReceivedImage(bytes, ImageColor::kGrey).empty());
        } catch (const InputError&) {
        }
      }
  }
}

}  // namespace
}  // namespace oaslam
