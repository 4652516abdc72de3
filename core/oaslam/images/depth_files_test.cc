#include "oaslam/images/depth_files.h"

#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/images/dataset.h"
#include "oaslam/log.h"

namespace oaslam {
namespace {

class DepthFilesTest : public FolderTest {
 protected:
  std::string WriteDepth(const std::string& name, int counts, int type = CV_16UC1) const {
    folder.Write(name, "");
    cv::imwrite(folder / name, cv::Mat(24, 32, type, cv::Scalar(counts)));
    return folder / name;
  }
  // The counts of the depth of each image; 0: none.
  static std::vector<int> Counts(DepthSource& source, const std::vector<ListedImage>& images) {
    std::vector<int> counts;
    for (const ListedImage& image : images) {
      const auto depth = source.Find(image.path);
      counts.push_back(depth ? depth->image.at<uint16_t>(0, 0) : 0);
    }
    return counts;
  }
  std::vector<int> Matched(const std::string& path, const std::vector<ListedImage>& images) const {
    DepthSource source(LoadDepthFiles(path), images);
    return Counts(source, images);
  }
};

TEST_F(DepthFilesTest, AFolderIsMatchedByNumbers) {
  for (const int i : {7, 9, 10})
    WriteDepth("depth/frame-0000" + std::to_string(10 + i) + ".depth.png", i);
  const std::vector<ListedImage> images{{0, "rgb/frame-000017.color.png"},
                                        {.1, "rgb/frame-000018.color.png"},
                                        {.2, "rgb/frame-000019.color.png"}};
  EXPECT_EQ(Matched(folder / "depth", images), (std::vector{7, 0, 9}));
  EXPECT_EQ(LoadDepthFiles(folder / "depth").unit, .001);
}

TEST_F(DepthFilesTest, AListIsMatchedByTimes) {
  for (const int i : {1, 2, 3}) WriteDepth("depth/" + std::to_string(i) + ".png", i);
  const std::string list = folder.Write(
      "depth.txt", "# depth\n10.01 depth/1.png\n10.045 depth/2.png\n10.2 depth/3.png\n");
  const std::vector<ListedImage> images{
      {10, "a.png"}, {10.03, "b.png"}, {10.06, "c.png"}, {10.1, "d.png"}, {10.219, "e.png"}};
  EXPECT_EQ(Matched(list, images), (std::vector{1, 2, 2, 0, 3}));
  EXPECT_EQ(LoadDepthFiles(list).unit, 1.0 / 5000);
}

TEST_F(DepthFilesTest, AnAssociationNamesTheImages) {
  for (const int i : {1, 2}) WriteDepth("depth/" + std::to_string(i) + ".png", i);
  const std::string list =
      folder.Write("associations.txt", "5 rgb/x.png 5.1 depth/2.png\n6 depth/1.png 6 rgb/y.png\n");
  EXPECT_EQ(Matched(list, {{0, "rgb/x.png"}, {1, "rgb/y.png"}, {2, "rgb/z.png"}}),
            (std::vector{2, 1, 0}));
}

TEST_F(DepthFilesTest, OtherNamesAreMatchedInTheirOrder) {
  WriteDepth("depth/a.png", 1);
  WriteDepth("depth/b.png", 2);
  EXPECT_EQ(Matched(folder / "depth", {{0, "left.png"}, {1, "right.png"}}), (std::vector{1, 2}));
  EXPECT_INPUT_ERROR(Matched(folder / "depth", {{0, "left.png"}}),
                     testing::HasSubstr("none of its 2 depths belongs to one of the 1 images"));
}

TEST_F(DepthFilesTest, WhatIsNotTrustedIsNotMeasured) {
  WriteDepth("depth/0.png", 800);
  cv::Mat trust(24, 32, CV_8UC1, cv::Scalar(2));
  trust.at<uint8_t>(0, 1) = 0;
  folder.Write("confidence/0.png", "");
  cv::imwrite(folder / "confidence/0.png", trust);
  DepthFiles files = LoadDepthFiles(folder / "depth");
  files.confidence = folder / "confidence";
  DepthSource source(files, {{0, "0.jpg"}});
  const cv::Mat depth = source.Find("0.jpg")->image;
  EXPECT_EQ(depth.at<uint16_t>(0, 0), 800);
  EXPECT_EQ(depth.at<uint16_t>(0, 1), 0);
}

TEST_F(DepthFilesTest, ACameraTellsWhereItIs) {
  WriteDepth("depth/0.png", 800);
  const std::string camera =
      "image_width: 32\nimage_height: 24\ncamera_matrix: {rows: 3, cols: 3, data: [50, 0, 16, 0, "
      "50, "
      "12, 0, 0, 1]}\ndistortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, "
      "data: [0, 0, 0, 0, 0]}\n";
  DepthFiles files = LoadDepthFiles(folder / "depth");
  SetDepthCamera(folder.Write("camera.yaml",
                              camera + "T_cam_depth: [1, 0, 0, -0.03, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,"
                                       " 0, 1]\n"),
                 files);
  DepthSource source(files, {{0, "0.jpg"}});
  EXPECT_EQ(source.Find("0.jpg")->camera->fx, 50);
  EXPECT_EQ(source.Find("0.jpg")->cam_from_depth.translation.x(), -0.03);
  EXPECT_INPUT_ERROR(
      SetDepthCamera(folder.Write("bad.yaml", camera + "T_cam_depth: [1, 2]\n"), files),
      testing::HasSubstr("bad.yaml: T_cam_depth: 2 values, expected 16"));
}

TEST_F(DepthFilesTest, WhatIsNoDepthIsNamed) {
  EXPECT_INPUT_ERROR(LoadDepthFiles(folder.Write("bad.txt", "1 depth/1.png\nx depth/2.png\n")),
                     testing::HasSubstr("bad.txt:2: \"x depth/2.png\", expected \"time depth\""));
  EXPECT_INPUT_ERROR(LoadDepthFiles(folder.Write("empty.txt", "# none\n")),
                     testing::HasSubstr("empty.txt: no depth images in it"));
  WriteDepth("grey/0.png", 80, CV_8UC1);
  EXPECT_INPUT_ERROR(Matched(folder / "grey", {{0, "0.png"}}),
                     testing::HasSubstr("0.png: 8 bits and 1 channels, expected a depth image"));
  WriteDepth("depth/0.png", 80);
  folder.Write("depth/1.png", "no image");
  std::vector<std::string> said;
  SetLogSink([&](LogLevel, const std::string& text) { said.push_back(text); });
  DepthSource source(
      {.path = "depth", .files = {{folder / "depth/0.png"}, {folder / "depth/1.png"}}},
      {{0, "0.png"}, {1, "1.png"}});
  EXPECT_EQ(Counts(source, {{0, "0.png"}, {1, "1.png"}, {1, "1.png"}}), (std::vector{80, 0, 0}));
  SetLogSink({});
  EXPECT_EQ(said.size(), 1);
}

TEST_F(DepthFilesTest, DatasetsHaveTheirs) {
  const std::string image = "P5\n2 2\n255\nabcd";
  folder.Write("tum/rgb/1.5.png", image);
  folder.Write("tum/rgb.txt", "1.5 rgb/1.5.png\n");
  EXPECT_FALSE(FindDataset(folder / "tum", {})->depth);
  folder.Write("tum/depth.txt", "1.51 depth/1.51.png\n");
  EXPECT_FALSE(FindDataset(folder / "tum", {})->depth);  // their images are left out
  WriteDepth("tum/depth/1.51.png", 5000);
  const auto tum = FindDataset(folder / "tum", {});
  ASSERT_TRUE(tum->depth);
  EXPECT_EQ(tum->depth->unit, 1.0 / 5000);
  DepthSource of_tum(*tum->depth, tum->images);
  EXPECT_EQ(Counts(of_tum, tum->images), std::vector{5000});

  folder.Write("scene/frame-000000.color.png", image);
  WriteDepth("scene/frame-000000.depth.png", 900);
  const auto scene = FindDataset(folder / "scene", {});
  ASSERT_TRUE(scene->depth && scene->depth->camera);
  EXPECT_EQ(scene->depth->camera->fx, 585);
  EXPECT_EQ(scene->depth->unit, .001);
}

}  // namespace
}  // namespace oaslam
