#include "oaslam/image_source.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <filesystem>
#include <utility>
#include <vector>

#include "exif_jpeg.h"
#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/images/image_files.h"

namespace oaslam {
namespace {

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

struct ImageSourceTest : FolderTest {};

TEST_F(ImageSourceTest, FolderInNaturalOrder) {
  for (const char* name : {"10.pgm", "2.pgm", "1.PGM", "b.pgm", "notes.txt"})
    folder.Write(name, Pgm(8, 6, 50));
  const auto images = ReadAll(folder.path(), {.fps = 10});
  EXPECT_THAT(Names(images), ElementsAre("1.PGM", "2.pgm", "10.pgm", "b.pgm"));
  EXPECT_DOUBLE_EQ(images[3].timestamp, 0.3);
  EXPECT_EQ(images[0].image.type(), CV_8UC1);
  EXPECT_EQ(images[0].image.size(), cv::Size(8, 6));
  EXPECT_EQ(ReadAll(folder.path(), {.color = true})[0].image.type(), CV_8UC3);
}

std::vector<double> Times(const std::vector<InputImage>& images) {
  std::vector<double> times;
  for (const InputImage& image : images) times.push_back(image.timestamp);
  return times;
}

TEST_F(ImageSourceTest, NamesThatAreTimesGiveOrderAndTimes) {
  for (const char* name :
       {"1500000000.0.pgm", "1500000000.1.pgm", "1500000000.033333.pgm", "1500000000.066667.pgm"})
    folder.Write(std::string("d/") + name, Pgm(8, 6, 50));
  const auto images = ReadAll(folder / "d");
  EXPECT_THAT(Names(images), ElementsAre("1500000000.0.pgm", "1500000000.033333.pgm",
                                         "1500000000.066667.pgm", "1500000000.1.pgm"));
  EXPECT_THAT(Times(images),
              ElementsAre(1500000000.0, 1500000000.033333, 1500000000.066667, 1500000000.1));
  EXPECT_THAT(Times(ReadAll(folder / "d", {.fps = 10})), ElementsAre(0, 0.1, 0.2, 0.3));
  EXPECT_EQ(ReadAll(folder / "d", {.from = 1})[0].name, "1500000000.033333.pgm");
  // The same of a list without times, as `ls` writes it.
  const std::string list = folder.Write("l.txt",
                                        "d/1500000000.0.pgm\nd/1500000000.033333.pgm\n"
                                        "d/1500000000.066667.pgm\nd/1500000000.1.pgm\n");
  EXPECT_EQ(Times(ReadAll(list)), Times(images));
  // Digits of different lengths before the point.
  for (const char* name : {"9.9.pgm", "10.0.pgm", "9.95.pgm"})
    folder.Write(std::string("e/") + name, Pgm(8, 6, 50));
  EXPECT_THAT(Times(ReadAll(folder / "e")), ElementsAre(9.9, 9.95, 10.0));
}

TEST_F(ImageSourceTest, UnitsOfTime) {
  const auto list = [&](double first, double step) {
    std::string text;
    for (int i = 0; i < 12; ++i) text += fmt::format("{:.6f} a.pgm\n", first + i * step);
    return folder.Write("list.txt", text);
  };
  folder.Write("a.pgm", Pgm(8, 6, 50));
  const auto error = [&](double first, double step, const ImageSourceOptions& options = {}) {
    return InputErrorOf([&] { OpenImages(list(first, step), options); });
  };
  EXPECT_THAT(error(1403636579763555584, 33333333),
              HasSubstrs("list.txt: ", "looks like ns", "--time-unit ns"));
  EXPECT_THAT(error(1403636579763555, 33333), HasSubstr("--time-unit us"));
  EXPECT_THAT(error(0, 33), HasSubstr("--time-unit ms"));
  const auto read = ReadAll(list(1403636579763, 50), {.time_unit = 1e-3});
  EXPECT_NEAR(read[1].timestamp - read[0].timestamp, 0.05, 1e-6);
  EXPECT_EQ(ReadAll(list(0, 33), {.time_unit = 1})[1].timestamp, 33);
  // The header of EuRoC's lists names the unit; their images are in the folder `data`.
  folder.Write("data/7.pgm", Pgm(8, 6, 50));
  const auto euroc = ReadAll(
      folder.Write("data.csv", "#timestamp [ns],filename\r\n1403636579763555584,7.pgm\r\n"));
  EXPECT_NEAR(euroc.at(0).timestamp, 1403636579.763555584, 1e-6);
  EXPECT_FALSE(euroc.at(0).image.empty());
  for (const char* name : {"1403636579763555584.pgm", "1403636579813555456.pgm"})
    folder.Write(std::string("ns/") + name, Pgm(8, 6, 50));
  const auto named = ReadAll(folder / "ns");
  EXPECT_NEAR(named[1].timestamp - named[0].timestamp, 0.05, 1e-6);
  folder.Write("x/a.pgm", Pgm(8, 6, 50));
  EXPECT_INPUT_ERROR(OpenImages(folder / "x", {.time_unit = 1e-3}),
                     HasSubstr("names of the images are no times"));
}

TEST_F(ImageSourceTest, HelperFilesAreNoImages) {
  const std::string apple_double("\0\5\26\7\0\2\0\0Mac OS X        ", 24);
  for (const char* name : {"000000.pgm", "000001.pgm", "000002.pgm"})
    folder.Write(name, Pgm(8, 6, 50));
  folder.Write("._000000.pgm", apple_double);
  folder.Write("000000_thumb.pgm", Pgm(4, 3, 50));
  folder.Write("thumb_000001.pgm", Pgm(4, 3, 50));
  folder.Write(".hidden.pgm", Pgm(8, 6, 50));
  folder.Write("000000a.png", "<html>not found</html>\n");
  folder.Write("0000.jpg", apple_double);
  folder.Write("Thumbs.db", "db");
  folder.Write(".DS_Store", "db");
  const auto images = ReadAll(folder.path());
  EXPECT_THAT(Names(images), ElementsAre("000000.pgm", "000001.pgm", "000002.pgm"));
  EXPECT_DOUBLE_EQ(images[2].timestamp, 2.0 / 30);
  // Nor in a list, as `find` writes it.
  const auto listed =
      ReadAll(folder.Write("list.txt", "._000000.pgm\n000000.pgm\n.DS_Store\n000001.pgm\n"));
  EXPECT_THAT(Names(listed), ElementsAre("000000.pgm", "000001.pgm"));
  EXPECT_DOUBLE_EQ(listed[1].timestamp, 1.0 / 30);
}

TEST_F(ImageSourceTest, DamagedImagesKeepTheirPlace) {
  folder.Write("0.pgm", Pgm(8, 6, 50));
  folder.Write("1.pgm", "");                      // the disk was full
  folder.Write("2.pgm", std::string(100, '\0'));  // power failed
  folder.Write("3.pgm", Pgm(8, 6, 50).substr(0, 20));
  folder.Write("4.pgm", Pgm(8, 6, 50));
  const auto images = ReadAll(folder.path());
  EXPECT_THAT(Names(images), ElementsAre("0.pgm", "1.pgm", "2.pgm", "3.pgm", "4.pgm"));
  EXPECT_TRUE(images[1].image.empty());
  EXPECT_TRUE(images[2].image.empty());
  EXPECT_DOUBLE_EQ(images[4].timestamp, 4.0 / 30);
}

TEST_F(ImageSourceTest, WhatIsNoTextIsNoList) {
  const auto error = [&](const std::string& source) {
    return InputErrorOf([&] { OpenImages(source, {}); });
  };
  std::string noise;  // without a zero, as a raw film may be
  for (int i = 0; i < 5000; ++i) noise += static_cast<char>(1 + (i * 7919) % 255);
  for (const auto& [name, content] : {std::pair{"film.bin", noise},
                                      {"small.tgz", std::string("\x1f\x8b\x08\x08 abc\x01")},
                                      {"grey.yuv", std::string(100000, '\x80')}}) {
    EXPECT_THAT(error(folder.Write(name, content)),
                HasSubstrs(name, "neither a list of images nor a video"));
  }
  EXPECT_THAT(error("/dev/zero"), HasSubstr("/dev/zero: is a device"));
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(error(pipe), HasSubstr("is a pipe"));
  // A line of a list does not reach the terminal as it is, nor whole.
  const std::string message =
      error(folder.Write("list.txt", "1.5 a.png\nb\xc2\x9b[31m" + std::string(5000, 'x') + "\n"));
  EXPECT_THAT(message, HasSubstr("list.txt:2: \"b"));
  EXPECT_LT(message.size(), 300);
}

TEST_F(ImageSourceTest, LinksThatLeadNowhere) {
  std::filesystem::create_symlink("self.png", folder / "self.png");
  std::filesystem::create_symlink("gone.png", folder / "link.png");
  const auto error = [&](const std::string& source) {
    return InputErrorOf([&] { OpenImages(source, {}); });
  };
  EXPECT_THAT(error(folder / "self.png"), HasSubstr("leads back to itself"));
  EXPECT_THAT(error(folder / "link.png"), HasSubstr("is a link to gone.png, which is not there"));
  folder.Write("a.pgm", Pgm(8, 6, 50));
  const auto images = ReadAll(folder.path());
  EXPECT_THAT(Names(images), ElementsAre("a.pgm", "link.png", "self.png"));
  EXPECT_TRUE(images[1].image.empty());
}

TEST_F(ImageSourceTest, Associations) {
  folder.Write("rgb/1.pgm", Pgm(8, 6, 50));
  for (const char* line :
       {"1.5 rgb/1.pgm 1.52 depth/1.png\n", "1.52 depth/1.png 1.5 rgb/1.pgm\n"}) {
    const auto images = ReadAll(folder.Write("associations.txt", line));
    EXPECT_THAT(Names(images), ElementsAre("1.pgm"));
    EXPECT_EQ(images[0].timestamp, 1.5);
    EXPECT_FALSE(images[0].image.empty());
  }
}

TEST_F(ImageSourceTest, TumFolderWithAMissingAndABrokenImage) {
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

TEST_F(ImageSourceTest, ListOfPathsAndRange) {
  for (const char* name : {"x.pgm", "y.pgm", "z.pgm"}) folder.Write(name, Pgm(4, 4, 9));
  const std::string list = folder.Write("list.txt", "x.pgm\ny.pgm\n" + (folder / "z.pgm") + "\n");
  const auto images = ReadAll(list, {.from = 1, .to = 10});
  EXPECT_THAT(Names(images), ElementsAre("y.pgm", "z.pgm"));
  EXPECT_EQ(images[0].index, 1);
  EXPECT_DOUBLE_EQ(images[0].timestamp, 1.0 / 30);
  EXPECT_FALSE(images[1].image.empty());
  EXPECT_THAT(Names(ReadAll(list, {.to = 1})), ElementsAre("x.pgm"));
}

TEST_F(ImageSourceTest, ListsWithAHeaderOrThePathFirst) {
  for (const char* name : {"x 1.pgm", "y.pgm"}) folder.Write(name, Pgm(4, 4, 9));
  for (const char* text :
       {"timestamp,filename\n0.5,x 1.pgm\n0.75,y.pgm\n", "x 1.pgm 0.5\r\ny.pgm 0.75\r\n",
        "x 1.pgm,0.5\ny.pgm, 0.75\n", "Time [ns],image\n500000000,x 1.pgm\n750000000,y.pgm\n"}) {
    const auto images = ReadAll(folder.Write("list.txt", text));
    EXPECT_THAT(Names(images), ElementsAre("x 1.pgm", "y.pgm")) << text;
    ASSERT_EQ(images.size(), 2u);
    EXPECT_NEAR(images[0].timestamp, 0.5, 1e-9) << text;
    EXPECT_NEAR(images[1].timestamp, 0.75, 1e-9) << text;
    EXPECT_FALSE(images[0].image.empty()) << text;
  }
}

TEST_F(ImageSourceTest, WhereTheImagesAreIsSaid) {
  folder.Write("cam0/data/1.pgm", Pgm(4, 4, 9));
  folder.Write("cam1/data/1.pgm", Pgm(4, 4, 9));
  EXPECT_INPUT_ERROR(ReadAll(folder.path()), HasSubstrs("no images", folder / "cam0/data"));
  for (const char* pattern : {"cam0/data/%06d.png", "cam0/data/*.png"})
    EXPECT_INPUT_ERROR(ReadAll(folder / pattern), HasSubstrs("no such file", "give the folder"));
  for (const char* name : {"b.bag", "a.bag", "c.txt"})
    folder.Write(std::string("drives/") + name, "#ROSBAG V2.0\n");
  EXPECT_INPUT_ERROR(ReadAll(folder / "drives"),
                     HasSubstrs("no images; there are some in", folder / "drives/a.bag"));
}

TEST_F(ImageSourceTest, ListsFindNamesInEitherNormalForm) {
  folder.Write("u\xCC\x88.pgm", Pgm(4, 4, 9));
  EXPECT_FALSE(ReadAll(folder.Write("list.txt", "0.5 ü.pgm\n"))[0].image.empty());
}

TEST_F(ImageSourceTest, ExifOrientationIsAppliedWhereAskedFor) {
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

TEST_F(ImageSourceTest, BadInputIsNamed) {
  const auto error = [](const std::string& source, const ImageSourceOptions& options = {}) {
    return InputErrorOf([&] { OpenImages(source, options); });
  };
  EXPECT_THAT(error(folder / "nowhere"), HasSubstr("no such file"));
  EXPECT_THAT(error(folder.path()), HasSubstr("no images"));
  EXPECT_THAT(error(folder.Write("empty.txt", "# nothing\n")), HasSubstr("no images"));
  EXPECT_THAT(error(folder.Write("empty.mp4", "")), HasSubstr("empty.mp4: is empty"));
  EXPECT_THAT(error(folder.Write("mixed.txt", "1.5 a.png\nb.png\n")),
              HasSubstrs("mixed.txt:2", "timestamp path"));
  EXPECT_THAT(error(folder.Write("lone.txt", "1.5\n")), HasSubstr("lone.txt:1"));
  EXPECT_THAT(error(folder.Write("noise.mp4", std::string("\0\1\2\3", 4))), HasSubstr("noise.mp4"));
  EXPECT_THAT(error("webcam:x"), HasSubstr("webcam:N"));
  const std::string list = folder.Write("list.txt", "a.png\n");
  EXPECT_THAT(error(list, {.from = 1}), HasSubstr("has 1 images"));
  EXPECT_THAT(error(list, {.from = -1}), HasSubstr("--from -1"));
  EXPECT_THAT(error(list, {.from = 3, .to = 3}), HasSubstr("--to 3"));
  EXPECT_THAT(error(list, {.fps = 0}), HasSubstr("--fps"));
}

TEST_F(ImageSourceTest, RecordingsOfOtherToolsAreNamed) {
  for (const auto& [name, what] :
       std::vector<std::pair<std::string, std::string>>{{"a.r3d", "unzip"},
                                                        {"a.SVO2", "ZED"},
                                                        {"a.vrs", "vrs extract-images"},
                                                        {"a.zip", "unzip"},
                                                        {"a.mcap", "ROS"}}) {
    folder.Write(name, "PK");
    EXPECT_INPUT_ERROR(OpenImages(folder / name), HasSubstrs(name + ": is ", what));
  }
}

}  // namespace
}  // namespace oaslam
