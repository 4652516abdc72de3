#include "oaslam/detection_file.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

constexpr const char* kOwn = R"([{"file_name": "rgb/0001.png", "detections": [
  {"category_id": 41, "detection_score": 0.8, "bbox": [-10.5, 2, 3, 4.25]},
  {"category_id": 56, "detection_score": 0.5, "bbox": [1, 2, 30, 40], "ellipse": [15, 20, 10, 12, 0.5]}]},
 {"file_name": "1311868164.363181", "detections": []}])";

std::string ErrorOf(const std::string& text) {
  const TempFolder folder;
  return InputErrorOf([&] { LoadDetections(folder.Write("d.json", text)); });
}

std::string WithBox(const std::string& box) {
  return R"([{"file_name": "7.png", "detections": [
             {"category_id": 1, "detection_score": 0.8, "bbox": )" +
         box + "}]}]";
}

// Boxes of an image, the first `bad` of them inverted.
std::string WithBadBoxes(int bad, int good) {
  std::string text = R"([{"file_name": "7.png", "detections": [)";
  for (int i = 0; i < bad + good; ++i)
    text += fmt::format(R"({}{{"category_id": 1, "detection_score": 0.8, "bbox": [5, 0, {}, 9]}})",
                        i > 0 ? "," : "", i < bad ? 1 : 9);
  return text + "]}]";
}

struct DetectionFileTest : FolderTest {};

TEST_F(DetectionFileTest, AFewBadBoxesAreLeftOut) {
  for (const auto& [bad, good] : {std::pair{1, 1}, {1, 30}, {5, 20}})
    EXPECT_THAT(LoadDetections(folder.Write("d.json", WithBadBoxes(bad, good))).Find("7"),
                SizeIs(good));
  // Python writes NaN, which is no JSON.
  EXPECT_THAT(LoadDetections(folder.Write("d.json", R"([{"file_name": "NaN.png", "detections": [
    {"category_id": 1, "detection_score": NaN, "bbox": [0, 0, 1, 1]},
    {"category_id": 1, "detection_score": 0.5, "bbox": [0, 0, -Infinity, 1]},
    {"category_id": 1, "detection_score": 0.5, "bbox": [0, 0, 1, 1]},
    {"category_id": 1, "detection_score": 0.5, "bbox": [0, 0, 1, 1]},
    {"category_id": 1, "detection_score": 0.5, "bbox": [0, 0, 1, 1]},
    {"category_id": 1, "detection_score": 0.5, "bbox": [0, 0, 1, 1]},
    {"category_id": 1, "detection_score": 0.5, "bbox": [0, 0, 1, 1]},
    {"category_id": 1, "detection_score": 0.5, "bbox": [0, 0, 1, 1]}]}])"))
                  .Find("NaN.png"),
              SizeIs(6));
  // In a file of x, y, width and height many boxes are inverted.
  EXPECT_THAT(ErrorOf(WithBadBoxes(6, 10)),
              HasSubstrs("7.png, detection 0", "the first of 6 bad ones of 16"));
  EXPECT_THAT(ErrorOf(WithBadBoxes(3, 0)), HasSubstr("the first of 3 bad ones of 3"));
}

TEST_F(DetectionFileTest, FindsByBaseNameThenWithoutExtension) {
  const DetectionTable table = LoadDetections(folder.Write("d.json", kOwn));
  EXPECT_THAT(table.Find("0001.png"), SizeIs(2));
  EXPECT_THAT(table.Find("elsewhere/0001.jpg"), SizeIs(2));
  EXPECT_THAT(table.Find("0001"), SizeIs(2));
  EXPECT_THAT(table.Find("0002.png"), IsEmpty());
  EXPECT_THAT(table.Find("1311868164.999999"), IsEmpty());
  const Detection& first = table.Find("0001.png")[0];
  EXPECT_EQ(first.category_id, 41);
  EXPECT_EQ(first.box, (Box{-10.5, 2, 3, 4.25}));
  EXPECT_EQ((*table.Find("0001.png")[1].ellipse)[4], 0.5);
}

TEST_F(DetectionFileTest, RoundTrip) {
  const DetectionTable table = LoadDetections(folder.Write("d.json", kOwn));
  SaveDetections(folder / "copy.json", table.images());
  SaveDetections(folder / "again.json", LoadDetections(folder / "copy.json").images());
  EXPECT_EQ(folder.Read("copy.json"), folder.Read("again.json"));
  const DetectionTable copy = LoadDetections(folder / "copy.json");
  ASSERT_THAT(copy.images(), SizeIs(2));
  EXPECT_EQ(copy.Find("0001.png")[0].box, table.Find("0001.png")[0].box);
  SaveDetections(folder / "none.json", {});
  EXPECT_THAT(LoadDetections(folder / "none.json").images(), IsEmpty());
}

TEST_F(DetectionFileTest, WhatRoundingWouldMakeEmptyCanBeReadAgain) {
  const Detection thin{41, 0.5, {1, 2, 1.001, 4}, {{1, 2, 0.001, 3, 0}}, {}};
  SaveDetections(folder / "d.json", {{"7.png", {thin}}});
  const DetectionTable table = LoadDetections(folder / "d.json");
  ASSERT_THAT(table.Find("7.png"), SizeIs(1));
  EXPECT_EQ(table.Find("7.png")[0].box, thin.box);
}

TEST_F(DetectionFileTest, FoldersTellImagesOfOneNameApart) {
  const auto boxes = [](int category) {
    return std::vector{Detection{category, 0.5, {1, 2, 3, 4}, {}, {}}};
  };
  SaveDetections(folder / "d.json",
                 {{"left/1.png", boxes(1)}, {"right/1.png", boxes(2)}, {"2.png", boxes(3)}});
  const DetectionTable table = LoadDetections(folder / "d.json");
  EXPECT_EQ(table.Find("/data/left/1.png").at(0).category_id, 1);
  EXPECT_EQ(table.Find("right/1.png").at(0).category_id, 2);
  EXPECT_EQ(table.Find("right/2.png").at(0).category_id, 3);
  EXPECT_THAT(table.Find("1.png"), IsEmpty());
  EXPECT_THAT(table.Find("bright/1.png"), IsEmpty());
  SaveDetections(folder / "d.json", {{"left/1.png", {}}, {"left/1.png", {}}});
  EXPECT_INPUT_ERROR(LoadDetections(folder / "d.json"), HasSubstr("two entries with this name"));
}

TEST_F(DetectionFileTest, NamesThatAreNotUtf8AreReplaced) {
  SaveDetections(folder / "d.json", {{"caf\xE9.png", {}}});
  EXPECT_EQ(LoadDetections(folder / "d.json").images().at(0).file_name, "caf\uFFFD.png");
}

TEST_F(DetectionFileTest, NothingIsWrittenThatCannotBeRead) {
  const Detection good{41, 0.5, {1, 2, 3, 4}, {}, {}};
  Detection without_score = good, without_box = good;
  without_score.score = std::nan("");
  without_box.box.x2 = INFINITY;
  for (const Detection& bad : {without_score, without_box})
    EXPECT_INPUT_ERROR(SaveDetections(folder / "d.json", {{"7.png", {good, bad}}}),
                       HasSubstrs("7.png: detection 1", "not finite"));
  EXPECT_FALSE(std::filesystem::exists(folder / "d.json"));
}

TEST_F(DetectionFileTest, Coco) {
  const std::string results =
      R"([{"image_id": 9, "category_id": 3, "bbox": [10, 20, 5, 6], "score": 0.5}])";
  EXPECT_INPUT_ERROR(LoadDetections(folder.Write("r.json", results)), HasSubstr("r.images.json"));
  folder.Write(
      "r.images.json",
      R"({"images": [{"id": 9, "file_name": "a/img.jpg"}, {"id": 10, "file_name": "b.jpg"}]})");
  const DetectionTable table = LoadDetections(folder / "r.json");
  ASSERT_THAT(table.Find("img.jpg"), SizeIs(1));
  EXPECT_EQ(table.Find("img.jpg")[0].box, (Box{10, 20, 15, 26}));
  EXPECT_THAT(table.images(), SizeIs(2));
  const DetectionTable names = LoadDetections(folder.Write(
      "n.json",
      R"([{"image_id": "000123", "category_id": 3, "bbox": [1, 2, 5, 6], "score": 0.5}])"));
  EXPECT_THAT(names.Find("000123.png"), SizeIs(1));
  const DetectionTable whole = LoadDetections(folder.Write(
      "w.json",
      R"({"images": [{"id": 1, "file_name": "x.png"}], "annotations": [{"image_id": 1, "category_id": 3, "bbox": [1, 2, 5, 6]}]})"));
  EXPECT_EQ(whole.Find("x.png")[0].score, 1);
  EXPECT_INPUT_ERROR(
      LoadDetections(folder.Write(
          "r.json",
          R"([{"image_id": 9, "category_id": 3, "bbox": [10, 20, -5, 6], "score": 0.5}])")),
      HasSubstrs("entry 0 (a/img.jpg)", "bbox"));
}

TEST_F(DetectionFileTest, WhatIsNoListIsNamed) {
  const char* files[][2] = {
      {R"({"images": [], "annotations": [], "categories": {"0": "cup"}})", "categories"},
      {R"({"images": {"id": 1}, "annotations": []})", "images"},
      {R"({"images": [], "annotations": {"id": 1}})", "annotations"}};
  for (const auto& [text, key] : files)
    EXPECT_INPUT_ERROR(LoadDetections(folder.Write("d.json", text)),
                       HasSubstrs("d.json", key, "expected a list"));
}

TEST_F(DetectionFileTest, UltralyticsPredictions) {
  const DetectionTable table = LoadDetections(folder.Write("predictions.json", R"([
    {"image_id": 12, "file_name": "000012.jpg", "category_id": 41, "bbox": [10, 20, 5, 6], "score": 0.5},
    {"image_id": 12, "file_name": "000012.jpg", "category_id": 41, "bbox": [1, 2, 5, 6], "score": 0.5}])"));
  ASSERT_THAT(table.Find("000012"), SizeIs(2));
  EXPECT_EQ(table.Find("000012")[0].box, (Box{10, 20, 15, 26}));
}

std::string WithLabels(const std::string& labels, const std::string& more = "") {
  return R"([{"file_name": "7.png", "detections": [{"bbox": [0, 0, 1, 1], "labels": )" + labels +
         more + "}]}]";
}

TEST_F(DetectionFileTest, ReadsSeveralLabels) {
  const auto read = [&](const std::string& text) {
    return LoadDetections(folder.Write("d.json", text)).images().at(0).detections.at(0);
  };
  const Detection cup = read(WithLabels("[[45, 0.2], [41, 0.6], [40, 0.1]]"));
  EXPECT_EQ(cup.category_id, 41);
  EXPECT_EQ(cup.score, 0.6);
  EXPECT_EQ(cup.other_labels, (std::vector<Label>{{45, 0.2}, {40, 0.1}}));
  // The labels tell how the score is distributed.
  const Detection doubtful =
      read(WithLabels("[[41, 0.6], [45, 0.3]]", R"(, "category_id": 41, "detection_score": 0.4)"));
  EXPECT_EQ(doubtful.score, 0.4);
  EXPECT_NEAR(doubtful.other_labels.at(0).score, 0.2, 1e-12);
  EXPECT_THAT(read(WithLabels("[[41, 0.6]]")).other_labels, IsEmpty());
  SaveDetections(folder / "copy.json", {{"7.png", {cup}}});
  const Detection copy = LoadDetections(folder / "copy.json").images().at(0).detections.at(0);
  EXPECT_EQ(copy.other_labels, cup.other_labels);
  SaveDetections(folder / "faint.json",
                 {{"7.png", {Detection{41, 1e-5, cup.box, {}, {{45, 1e-6}}}}}});
  EXPECT_THAT(LoadDetections(folder / "faint.json").images().at(0).detections, SizeIs(1));
}

TEST_F(DetectionFileTest, BadLabelsAreNamed) {
  for (const char* labels :
       {"7", "[]", "[41, 0.6]", "[[41]]", "[[41, 0.6, 1]]", "[[41, 1.6]]", "[[-1, 0.6]]",
        "[[4.5, 0.6]]", "[[\"cup\", 0.6]]", "[[41, 0.6], [41, 0.3]]", "[[41, 0], [45, 0]]"})
    EXPECT_THAT(ErrorOf(WithLabels(labels)), HasSubstrs("d.json", "7.png, detection 0", "labels: "))
        << labels;
  EXPECT_THAT(ErrorOf(WithLabels("[[41, 0.6], [45, 0.3]]", R"(, "category_id": 45)")),
              HasSubstr("category_id: 45, but the best of its labels is 41"));
}

TEST_F(DetectionFileTest, BadEntriesAreNamed) {
  for (const char* box : {"[5, 0, 1, 9]", "[0, 9, 4, 9]", "[0, 0, 1e7, 9]", "[0, 0, 9]",
                          "[0, 0, null, 9]", "[0, 0, \"4\", 9]"})
    EXPECT_THAT(ErrorOf(WithBox(box)), HasSubstrs("d.json", "7.png, detection 0", "bbox")) << box;
  EXPECT_THAT(ErrorOf(WithBox("[0, 0, NaN, 9]")), HasSubstr("bbox: null, expected a number"));
  EXPECT_THAT(ErrorOf(WithBox("[0, 0, 1e999, 9]")), HasSubstr("d.json"));
  EXPECT_THAT(ErrorOf("[{\"file_name\": \"a\"}]"),
              HasSubstrs("entry 0", "\"detections\" is missing"));
  EXPECT_THAT(
      ErrorOf(
          R"([{"file_name": "a", "detections": [{"category_id": 1.5, "detection_score": 0.8, "bbox": [0,0,1,1]}]}])"),
      HasSubstr("category_id: 1.5"));
  EXPECT_THAT(
      ErrorOf(
          R"([{"file_name": "a", "detections": [{"category_id": 1, "detection_score": 1.8, "bbox": [0,0,1,1]}]}])"),
      HasSubstr("detection_score: 1.8, allowed: 0 to 1"));
  EXPECT_THAT(
      ErrorOf(
          R"([{"file_name": "a/1.png", "detections": []}, {"file_name": "a/1.png", "detections": []}])"),
      HasSubstr("a/1.png"));
  EXPECT_THAT(ErrorOf("[{\"file_name\""), HasSubstr("malformed JSON"));
  EXPECT_THAT(ErrorOf("17"), HasSubstr("expected a list"));
}

}  // namespace
}  // namespace oaslam
