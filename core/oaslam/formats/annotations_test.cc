#include "oaslam/formats/annotations.h"

#include <cmath>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/detection_file.h"
#include "oaslam/formats/rotated_box.h"

namespace oaslam {
namespace {

void ExpectBox(const Box& box, const Box& expected) {
  EXPECT_NEAR(box.x1, expected.x1, 1e-6);
  EXPECT_NEAR(box.y1, expected.y1, 1e-6);
  EXPECT_NEAR(box.x2, expected.x2, 1e-6);
  EXPECT_NEAR(box.y2, expected.y2, 1e-6);
}

struct AnnotationsTest : FolderTest {
  DetectionFile Read(const std::string& name, const std::string& text) const {
    return ReadDetectionFile(folder.Write(name, text));
  }
  std::string ErrorOf(const std::string& name, const std::string& text) const {
    return InputErrorOf([&] { LoadDetections(folder.Write(name, text)); });
  }
};

TEST_F(AnnotationsTest, RotatedBoxesAreTheirUprightHulls) {
  ExpectBox(RotatedHull({10, 20, 30, 60}, 0, {0, 0}), {10, 20, 30, 60});
  ExpectBox(RotatedHull({10, 20, 30, 60}, 90, {20, 40}), {0, 30, 40, 50});
  ExpectBox(RotatedHull({0, 0, 2, 2}, 45, {1, 1}),
            {1 - std::sqrt(2), 1 - std::sqrt(2), 1 + std::sqrt(2), 1 + std::sqrt(2)});
  ExpectBox(RotatedHull({0, 0, 4, 2}, 90, {0, 0}), {-2, 0, 0, 4});
}

// CVAT writes the box before its rotation, and the angle beside it.
TEST_F(AnnotationsTest, CvatsRotationCounts) {
  const auto read = [&](const std::string& attributes) {
    return Read("c.json", R"({"images": [{"id": 1, "file_name": "a.png"}],
      "categories": [{"id": 1, "name": "cup"}],
      "annotations": [{"id": 1, "image_id": 1, "category_id": 1, "bbox": [10, 20, 20, 40])" +
                              attributes + "}]}")
        .images.at(0)
        .detections.at(0)
        .box;
  };
  ExpectBox(read(""), {10, 20, 30, 60});
  ExpectBox(read(R"(, "attributes": {"occluded": false, "rotation": 0.0})"), {10, 20, 30, 60});
  ExpectBox(read(R"(, "attributes": {"rotation": 90.0})"), {0, 30, 40, 50});
  ExpectBox(read(R"(, "attributes": {"rotation": "none"})"), {10, 20, 30, 60});
}

TEST_F(AnnotationsTest, LabelmesShapesAreBoxes) {
  const std::string text = R"({"version": "5.4", "imagePath": "..\\film\\000003.jpg",
    "imageWidth": 640, "imageHeight": 480, "shapes": [
    {"label": "cup", "shape_type": "rectangle", "points": [[30, 60], [10, 20]]},
    {"label": "book", "shape_type": "polygon", "points": [[5, 5], [9, 7], [6, 12]]},
    {"label": "cup", "shape_type": "circle", "points": [[50, 50], [53, 54]], "score": 0.5},
    {"label": "cup", "shape_type": "point", "points": [[50, 50]]}]})";
  const DetectionFile one = Read("a.json", text);
  ASSERT_EQ(one.images.size(), 1U);
  EXPECT_EQ(one.images[0].file_name, "000003.jpg");
  const auto& found = one.images[0].detections;
  ASSERT_EQ(found.size(), 3U);
  ExpectBox(found[0].box, {10, 20, 30, 60});
  ExpectBox(found[1].box, {5, 5, 9, 12});
  ExpectBox(found[2].box, {45, 45, 55, 55});
  EXPECT_EQ(found[2].score, 0.5);
  EXPECT_EQ(one.categories.at(found[1].category_id), "book");
  // A folder of them, whose classes come in another order.
  folder.Write("l/000003.json", text);
  folder.Write("l/000001.json",
               R"({"shapes": [{"label": "book", "points": [[1, 1], [2, 2], [3, 1]]}]})");
  const DetectionFile all = ReadDetectionFile(folder / "l");
  ASSERT_EQ(all.images.size(), 2U);
  EXPECT_EQ(all.images[0].file_name, "000001.json");
  EXPECT_EQ(all.categories.at(all.images[0].detections[0].category_id), "book");
  EXPECT_EQ(all.categories.at(all.images[1].detections[0].category_id), "cup");
  EXPECT_THAT(ErrorOf("b.json", R"({"shapes": [{"label": "cup", "points": [[1, 2, 3], [1, 2]]}]})"),
              HasSubstrs("shapes[0]: points", "expected 2 numbers"));
}

TEST_F(AnnotationsTest, LabelStudiosTasksAreImages) {
  const DetectionFile full = Read("s.json", R"([
    {"id": 1, "data": {"image": "/data/upload/3/1a2b3c4d-000012.png"}, "annotations": [
      {"was_cancelled": true, "result": []},
      {"result": [
        {"type": "rectanglelabels", "original_width": 640, "original_height": 480,
         "value": {"x": 10, "y": 50, "width": 20, "height": 25, "rotation": 0,
                   "rectanglelabels": ["cup"]}},
        {"type": "rectanglelabels", "original_width": 200, "original_height": 100,
         "value": {"x": 50, "y": 0, "width": 10, "height": 40, "rotation": 90,
                   "rectanglelabels": ["book"]}},
        {"type": "choices", "value": {"choices": ["sharp"]}}]}]},
    {"id": 2, "data": {"image": "/data/local-files/?d=film%2F000013.png"}, "annotations": []}])");
  ASSERT_EQ(full.images.size(), 2U);
  EXPECT_EQ(full.images[0].file_name, "000012.png");
  EXPECT_EQ(full.images[1].file_name, "000013.png");
  ASSERT_EQ(full.images[0].detections.size(), 2U);
  ExpectBox(full.images[0].detections[0].box, {64, 240, 192, 360});
  // About its upper left corner.
  ExpectBox(full.images[0].detections[1].box, {60, 0, 100, 20});
  const DetectionFile brief = Read("m.json", R"([{"id": 1, "image": "a.png", "label": [
      {"x": 10, "y": 50, "width": 20, "height": 25, "rotation": 0, "rectanglelabels": ["cup"],
       "original_width": 640, "original_height": 480}]}])");
  ExpectBox(brief.images.at(0).detections.at(0).box, {64, 240, 192, 360});
  // An image that is no square: in percents of its sides a rotation would be sheared.
  const DetectionFile oblong = Read("o.json", R"([{"image": "a.png", "label": [
      {"x": 20, "y": 20, "width": 30, "height": 20, "rotation": 90, "rectanglelabels": ["cup"],
       "original_width": 1000, "original_height": 500}]}])");
  ExpectBox(oblong.images.at(0).detections.at(0).box, {100, 100, 200, 400});
  EXPECT_THAT(ErrorOf("n.json", R"([{"image": "a.png", "label": [{"rectanglelabels": ["cup"]}]}])"),
              HasSubstrs("a.png, result 0", "original_width"));
}

TEST_F(AnnotationsTest, YolosTextsAreSharesOfTheImage) {
  folder.Write("p/labels/000000.txt", "41 0.5 0.5 0.25 0.5\n0 0.1 0.1 0.1 0.1\n");
  folder.Write("p/labels/000002.txt", "");
  for (const std::string name : {"p", "p/labels"}) {
    DetectionFile file = ReadDetectionFile(folder / name);
    EXPECT_TRUE(file.in_shares);
    EXPECT_INPUT_ERROR(LoadDetections(folder / name), HasSubstrs("shares", "need the images"));
    ConvertShares(640, 480, file);
    ASSERT_EQ(file.images.size(), 2U);
    EXPECT_EQ(file.images[0].detections[0].category_id, 41);
    EXPECT_EQ(file.images[0].detections[0].score, 1);
    ExpectBox(file.images[0].detections[0].box, {240, 120, 400, 360});
    ConvertShares(640, 480, file);  // only once
    ExpectBox(file.images[0].detections[0].box, {240, 120, 400, 360});
  }
  // What detectors add: scores, tracks, both.
  const auto score = [&](const std::string& line, const std::string& other) {
    const TempFolder other_folder;
    other_folder.Write("a.txt", line + "\n" + other + "\n");
    return ReadDetectionFile(other_folder.path()).images.at(0).detections.at(0).score;
  };
  EXPECT_EQ(score("0 .5 .5 .2 .2 0.75", "0 .5 .5 .2 .2 0.5"), 0.75);
  EXPECT_EQ(score("0 .5 .5 .2 .2 1", "0 .5 .5 .2 .2 7"), 1);
  EXPECT_EQ(score("0 .5 .5 .2 .2 0.75 3", "0 .5 .5 .2 .2 0.5 4"), 0.75);
  // Classes beside them, as labelImg writes them.
  folder.Write("c/classes.txt", "dog\ncup\n");
  folder.Write("c/a.txt", "1 .5 .5 .2 .2\n");
  EXPECT_EQ(ReadDetectionFile(folder / "c").categories.at(1), "cup");
}

TEST_F(AnnotationsTest, OtherTextsAreNotTakenForBoxes) {
  const auto error = [](const std::string& line) {
    const TempFolder other;
    other.Write("a.txt", line + "\n");
    return InputErrorOf([&] { ReadDetectionFile(other.path()); });
  };
  EXPECT_THAT(error("0 .1 .1 .5 .1 .5 .5 .1 .5"), HasSubstrs("a.txt:1: 9 numbers", "polygons"));
  EXPECT_THAT(error("0 .1 .1 .5 .1 .5 .5"), HasSubstrs("a.txt:1: column 7", "polygons"));
  EXPECT_THAT(error("0 320 240 50 60"), HasSubstrs("a.txt:1", "expected shares"));
  EXPECT_THAT(error("cup .5 .5 .2 .2"), HasSubstrs("a.txt:1: \"cup\""));
  EXPECT_THAT(error("1.5 .5 .5 .2 .2"), HasSubstrs("class 1.5"));
  EXPECT_THAT(error("1e300 .5 .5 .2 .2"), HasSubstrs("class 1e+300"));
  folder.Write("x/a.xml", "<annotation/>");
  EXPECT_INPUT_ERROR(ReadDetectionFile(folder / "x"), HasSubstrs("has no boxes", "COCO"));
}

TEST_F(AnnotationsTest, TablesNameTheirColumns) {
  const DetectionFile file = Read("t.csv",
                                  "filename,width,height,class,xmin,ymin,xmax,ymax\n"
                                  "a.png,640,480,cup,10,20,30,60\n\"b.png\",640,480,book,1,2,3,4\n"
                                  "a.png,640,480,book,5,6,7,8\n");
  ASSERT_EQ(file.images.size(), 2U);
  ExpectBox(file.images[0].detections.at(0).box, {10, 20, 30, 60});
  EXPECT_EQ(file.images[0].detections.size(), 2U);
  EXPECT_EQ(file.categories.at(file.images[1].detections.at(0).category_id), "book");
  const DetectionFile scored =
      Read("u.csv",
           "\"image\",\"xmin\",\"ymin\",\"xmax\",\"ymax\",confidence,class\n"
           "a.png,10,20,30,60,0.5,41\n");
  EXPECT_EQ(scored.images[0].detections.at(0).score, 0.5);
  EXPECT_EQ(scored.images[0].detections.at(0).category_id, 41);
  EXPECT_TRUE(scored.categories.empty());
  EXPECT_THAT(ErrorOf("v.csv", "1,7,10,20,30,60,0.9\n"), HasSubstrs("v.csv:1", "xmin, ymin"));
  EXPECT_THAT(ErrorOf("v.csv", "image,x,y,width,height,class\na,1,2,3,4,5\n"),
              HasSubstrs("v.csv:1", "xmin, ymin"));
  EXPECT_THAT(ErrorOf("w.csv", "image,xmin,ymin,xmax,ymax,class\na.png,1,2,3\n"),
              HasSubstr("w.csv:2: 4 columns, but 6"));
  EXPECT_THAT(ErrorOf("w.csv", "image,xmin,ymin,xmax,ymax,class\na.png,1,2,x,4,1\n"),
              HasSubstr("w.csv:2: column 4"));
}

TEST_F(AnnotationsTest, WhatIsNotReadSaysHowToConvertIt) {
  EXPECT_THAT(ErrorOf("a.xml", "<annotations/>"), HasSubstrs("a.xml: XML", "COCO 1.0"));
  EXPECT_THAT(ErrorOf("via.json", R"({"a.png123": {"filename": "a.png", "regions": []}})"),
              HasSubstr("export COCO"));
}

}  // namespace
}  // namespace oaslam
