#include "oaslam/image_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "exif_jpeg.h"
#include "expect_input_error.h"
#include "oaslam/images/image_files.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

// A binary PGM of one grey level.
std::string Pgm(int width, int height, char level) {
  return "P5\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n" +
         std::string(static_cast<size_t>(width) * height, level);
}

std::vector<InputImage> ReadAll(const std::string& source, const ImageSourceOptions& options = {}) {
  const auto images = OpenImages(source, options);
  std::vector<InputImage> result;
  while (auto image = images->Next()) result.push_back(*image);
  EXPECT_EQ(images->size(), static_cast<int>(result.size()));
  return result;
}

std::vector<std::string> Names(const std::vector<InputImage>& images) {
  std::vector<std::string> names;
  for (const InputImage& image : images) names.push_back(image.name);
  return names;
}

TEST(ImageSource, FolderInNaturalOrder) {
  const TempFolder folder;
  for (const char* name : {"10.pgm", "2.pgm", "1.PGM", "b.pgm", "notes.txt"})
    folder.Write(name, Pgm(8, 6, 50));
  const auto images = ReadAll(folder.path(), {.fps = 10});
  EXPECT_THAT(Names(images), ElementsAre("1.PGM", "2.pgm", "10.pgm", "b.pgm"));
  EXPECT_DOUBLE_EQ(images[3].timestamp, 0.3);
  EXPECT_EQ(images[0].image.type(), CV_8UC1);
  EXPECT_EQ(images[0].image.size(), cv::Size(8, 6));
  EXPECT_EQ(ReadAll(folder.path(), {.color = true})[0].image.type(), CV_8UC3);
}

TEST(ImageSource, TumFolderWithAMissingAndABrokenImage) {
  const TempFolder folder;
  folder.Write("rgb/a b.pgm", Pgm(8, 6, 50));
  folder.Write("rgb/broken.png", "no image");
  folder.Write("rgb.txt",
               "# timestamp filename\n1.5 rgb/a b.pgm\n1.6 rgb/missing.png\n1.4 rgb/broken.png\n");
  const auto images = ReadAll(folder.path());
  EXPECT_THAT(Names(images), ElementsAre("a b.pgm", "missing.png", "broken.png"));
  EXPECT_FALSE(images[0].image.empty());
  EXPECT_TRUE(images[1].image.empty());
  EXPECT_TRUE(images[2].image.empty());
  EXPECT_EQ(images[2].timestamp, 1.4);  // as given, even backwards: the caller decides
}

TEST(ImageSource, ListOfPathsAndRange) {
  const TempFolder folder;
  for (const char* name : {"x.pgm", "y.pgm", "z.pgm"}) folder.Write(name, Pgm(4, 4, 9));
  const std::string list = folder.Write("list.txt", "x.pgm\ny.pgm\n" + (folder / "z.pgm") + "\n");
  const auto images = ReadAll(list, {.from = 1, .to = 10});
  EXPECT_THAT(Names(images), ElementsAre("y.pgm", "z.pgm"));
  EXPECT_EQ(images[0].index, 1);
  EXPECT_DOUBLE_EQ(images[0].timestamp, 1.0 / 30);
  EXPECT_FALSE(images[1].image.empty());
  EXPECT_THAT(Names(ReadAll(list, {.to = 1})), ElementsAre("x.pgm"));
}

TEST(ImageSource, ExifOrientationIsAppliedWhereAskedFor) {
  const TempFolder folder;
  cv::Mat image(48, 64, CV_8UC3, cv::Scalar::all(20));
  image.colRange(0, 32).setTo(240);
  // A portrait image as phones store it.
  const std::string path = folder.Write("a.jpg", JpegWithExif(image, {.orientation = 6}));
  for (const bool color : {false, true}) {
    EXPECT_EQ(ReadAll(path, {.color = color})[0].image.size(), cv::Size(64, 48));
    const InputImage turned =
        ReadAll(path, {.color = color, .orientation = Orientation::kUpright})[0];
    ASSERT_EQ(turned.image.size(), cv::Size(48, 64));
    EXPECT_GT(cv::mean(turned.image.rowRange(0, 30))[0], 230);  // its left is the top
    EXPECT_LT(cv::mean(turned.image.rowRange(34, 64))[0], 30);
    EXPECT_EQ(InColor(turned.image, turned.path, turned.orientation).size(), turned.image.size());
    EXPECT_EQ(InColor(turned.image, turned.path, turned.orientation).channels(), 3);
  }
}

TEST(ImageSource, BadInputIsNamed) {
  const TempFolder folder;
  const auto error = [](const std::string& source, const ImageSourceOptions& options = {}) {
    return InputErrorOf([&] { OpenImages(source, options); });
  };
  EXPECT_THAT(error(folder / "nowhere"), HasSubstr("no such file"));
  EXPECT_THAT(error(folder.path()), HasSubstr("no images"));
  EXPECT_THAT(error(folder.Write("empty.txt", "# nothing\n")), HasSubstr("no images"));
  EXPECT_THAT(error(folder.Write("empty.mp4", "")), HasSubstr("empty.mp4: is empty"));
  EXPECT_THAT(error(folder.Write("mixed.txt", "1.5 a.png\nb.png\n")),
              AllOf(HasSubstr("mixed.txt:2"), HasSubstr("timestamp path")));
  EXPECT_THAT(error(folder.Write("lone.txt", "1.5\n")), HasSubstr("lone.txt:1"));
  EXPECT_THAT(error(folder.Write("noise.mp4", std::string("\0\1\2\3", 4))), HasSubstr("noise.mp4"));
  EXPECT_THAT(error("webcam:x"), HasSubstr("webcam:N"));
  const std::string list = folder.Write("list.txt", "a.png\n");
  EXPECT_THAT(error(list, {.from = 1}), HasSubstr("has 1 images"));
  EXPECT_THAT(error(list, {.from = -1}), HasSubstr("--from -1"));
  EXPECT_THAT(error(list, {.from = 3, .to = 3}), HasSubstr("--to 3"));
  EXPECT_THAT(error(list, {.fps = 0}), HasSubstr("--fps"));
}

}  // namespace
}  // namespace oaslam
