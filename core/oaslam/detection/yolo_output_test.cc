#include "oaslam/detection/yolo_output.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "oaslam/detection/layout_check.h"

namespace oaslam {
namespace {

const cv::Size kYoloInput(64, 32);  // grids of 8x4, 4x2 and 2x1 cells: 42
constexpr int kCells = 42;
constexpr int kClasses = 3;

cv::Mat Tensor(int rows, int columns) {
  return cv::Mat(std::vector<int>{1, rows, columns}, CV_32F, cv::Scalar(0));
}

float& At(cv::Mat& tensor, int row, int column) { return tensor.at<float>(0, row, column); }

HeadMetadata HeadOf(int names, bool is_suppressed = false) {
  HeadMetadata head;
  for (int i = 0; i < names; ++i) head.names[i] = "name";
  head.is_suppressed = is_suppressed;
  return head;
}

// By the shape alone: the output is all zero.
std::optional<OutputFormat> Recognize(const std::vector<int>& shape, const cv::Size& size,
                                      DetectorLayout wanted, int names, bool is_suppressed,
                                      int masks = 0) {
  return RecognizeOutput(cv::Mat(shape, CV_32F, cv::Scalar(0)), size, wanted,
                         HeadOf(names, is_suppressed), masks);
}

void FillRow(cv::Mat& tensor, int row, const std::vector<float>& values) {
  for (size_t i = 0; i < values.size(); ++i) At(tensor, row, static_cast<int>(i)) = values[i];
}

void ExpectBox(const Box& box, double x1, double y1, double x2, double y2) {
  EXPECT_NEAR(box.x1, x1, 1e-4);
  EXPECT_NEAR(box.y1, y1, 1e-4);
  EXPECT_NEAR(box.x2, x2, 1e-4);
  EXPECT_NEAR(box.y2, y2, 1e-4);
}

TEST(YoloOutput, DecodesTheGridOfYolox) {
  cv::Mat tensor = Tensor(kCells, 5 + kClasses);
  // Cell (3, 1) of stride 8, and cell (1, 0) of stride 32: the last row.
  FillRow(tensor, 1 * 8 + 3, {0.5F, 0.25F, std::log(2.F), std::log(1.5F), 0.9F, 0.1F, 0.8F, 0.2F});
  FillRow(tensor, kCells - 1, {0.F, 0.5F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.5F});
  const auto found = DecodeOutput(tensor, {DetectorLayout::kYolox, kClasses}, kYoloInput, 0.3);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].category_id, 1);
  EXPECT_NEAR(found[0].score, 0.72, 1e-6);
  ExpectBox(found[0].box, 28 - 8, 10 - 6, 28 + 8, 10 + 6);
  EXPECT_EQ(found[1].category_id, 2);
  ExpectBox(found[1].box, 32 - 16, 16 - 16, 32 + 16, 16 + 16);
}

TEST(YoloOutput, DecodesRowsOfYolov5) {
  cv::Mat tensor = Tensor(3 * kCells, 5 + kClasses);
  FillRow(tensor, 100, {30, 20, 10, 4, 0.8F, 0.5F, 0.25F, 0.F});
  FillRow(tensor, 5, {30, 20, 10, 4, 0.2F, 1.F, 0.F, 0.F});  // objectness too low
  const auto found = DecodeOutput(tensor, {DetectorLayout::kYolov5, kClasses}, kYoloInput, 0.3);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].category_id, 0);
  EXPECT_NEAR(found[0].score, 0.4, 1e-6);
  ExpectBox(found[0].box, 25, 18, 35, 22);
}

TEST(YoloOutput, DecodesColumnsOfYolov8) {
  cv::Mat tensor = Tensor(4 + kClasses, kCells);
  const std::vector<float> column{30, 20, 10, 4, 0.1F, 0.2F, 0.9F};
  for (size_t i = 0; i < column.size(); ++i) At(tensor, static_cast<int>(i), 17) = column[i];
  const auto found = DecodeOutput(tensor, {DetectorLayout::kYolov8, kClasses}, kYoloInput, 0.3);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].category_id, 2);
  EXPECT_NEAR(found[0].score, 0.9, 1e-6);
  ExpectBox(found[0].box, 25, 18, 35, 22);
}

TEST(YoloOutput, IgnoresMaskCoefficients) {
  cv::Mat tensor = Tensor(4 + kClasses + 32, kCells);
  At(tensor, 2, 3) = At(tensor, 3, 3) = 10;
  At(tensor, 5, 3) = 0.6F;
  At(tensor, 20, 3) = 5;  // no class
  const auto format =
      Recognize({1, 4 + kClasses + 32, kCells}, kYoloInput, DetectorLayout::kAuto, kClasses, false);
  ASSERT_TRUE(format);
  EXPECT_EQ(format->classes, kClasses);
  const auto found = DecodeOutput(tensor, *format, kYoloInput, 0.3);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].category_id, 1);
}

TEST(YoloOutput, DecodesEndToEndRows) {
  cv::Mat tensor = Tensor(300, 6);
  FillRow(tensor, 0, {1, 2, 30, 20, 0.9F, 7});
  FillRow(tensor, 1, {1, 2, 30, 20, 0.1F, 7});
  const auto found = DecodeOutput(tensor, {DetectorLayout::kEndToEnd, 0}, kYoloInput, 0.3);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].category_id, 7);
  ExpectBox(found[0].box, 1, 2, 30, 20);
}

TEST(YoloOutput, PrototypesTellWhereCoefficientsBegin) {
  constexpr int kMasks = 4;
  const auto check = [&](const cv::Mat& tensor, const OutputFormat& format) {
    const auto found = DecodeOutput(tensor, format, kYoloInput, 0.3);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].category_id, 2);
    EXPECT_EQ(found[0].place, 17);
    EXPECT_EQ(MaskCoefficients(tensor, format, found[0].place), (std::vector<float>{9, 8, 7, 6}));
  };
  // Without names: the number of classes follows from that of the prototypes.
  const auto v8 = Recognize({1, 4 + kClasses + kMasks, kCells}, kYoloInput, DetectorLayout::kAuto,
                            0, false, kMasks);
  ASSERT_TRUE(v8);
  EXPECT_EQ(v8->classes, kClasses);
  cv::Mat columns = Tensor(4 + kClasses + kMasks, kCells);
  const std::vector<float> column{30, 20, 10, 4, 0.1F, 0.2F, 0.9F, 9, 8, 7, 6};
  for (size_t i = 0; i < column.size(); ++i) At(columns, static_cast<int>(i), 17) = column[i];
  check(columns, *v8);

  const auto v5 = Recognize({1, 3 * kCells, 5 + kClasses + kMasks}, kYoloInput,
                            DetectorLayout::kAuto, 0, false, kMasks);
  ASSERT_TRUE(v5);
  EXPECT_EQ(v5->layout, DetectorLayout::kYolov5);
  EXPECT_EQ(v5->classes, kClasses);
  cv::Mat rows = Tensor(3 * kCells, 5 + kClasses + kMasks);
  FillRow(rows, 17, {30, 20, 10, 4, 1, 0.1F, 0.2F, 0.9F, 9, 8, 7, 6});
  check(rows, *v5);

  const auto end_to_end = Recognize({1, 300, 6 + kMasks}, kYoloInput, DetectorLayout::kAuto, 0,
                                    true, kMasks);  // YOLO26-seg
  ASSERT_TRUE(end_to_end);
  EXPECT_EQ(end_to_end->layout, DetectorLayout::kEndToEnd);
  cv::Mat listed = Tensor(300, 6 + kMasks);
  FillRow(listed, 17, {25, 18, 35, 22, 0.9F, 2, 9, 8, 7, 6});
  check(listed, *end_to_end);
  EXPECT_FALSE(Recognize({1, 300, 6 + kMasks}, kYoloInput, DetectorLayout::kEndToEnd, 0, true));
}

TEST(YoloOutput, DropsWhatIsNoBox) {
  cv::Mat tensor = Tensor(kCells, 5 + kClasses);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  FillRow(tensor, 0, {nan, 0, 0, 0, 1, 1, 0, 0});
  FillRow(tensor, 1, {0, 0, 1e4F, 0, 1, 1, 0, 0});  // exp overflows
  FillRow(tensor, 2, {0, 0, 0, 0, nan, 1, 0, 0});
  EXPECT_TRUE(DecodeOutput(tensor, {DetectorLayout::kYolox, kClasses}, kYoloInput, 0.3).empty());
}

DetectorLayout Guess(const std::vector<int>& shape, int size = 640, int names = 0,
                     bool end_to_end = false) {
  const auto format = Recognize(shape, {size, size}, DetectorLayout::kAuto, names, end_to_end);
  return format ? format->layout : DetectorLayout::kAuto;
}

TEST(YoloOutput, TellsLayoutsApart) {
  EXPECT_EQ(Guess({1, 3549, 85}, 416), DetectorLayout::kYolox);
  EXPECT_EQ(Guess({1, 25200, 85}), DetectorLayout::kYolov5);
  EXPECT_EQ(Guess({25200, 85}), DetectorLayout::kYolov5);
  EXPECT_EQ(Guess({1, 25200, 6}), DetectorLayout::kYolov5);          // one class, not end-to-end
  EXPECT_EQ(Guess({1, 102000, 85}, 1280), DetectorLayout::kYolov5);  // with a grid of stride 64
  EXPECT_EQ(Guess({1, 84, 8400}), DetectorLayout::kYolov8);
  EXPECT_EQ(Guess({1, 6, 8400}), DetectorLayout::kYolov8);  // two classes
  EXPECT_EQ(Guess({1, 300, 6}), DetectorLayout::kEndToEnd);
  EXPECT_EQ(Guess({1, 2000, 6}, 640, 80, true), DetectorLayout::kEndToEnd);
}

TEST(YoloOutput, RefusesOtherNetworks) {
  EXPECT_EQ(Guess({1, 1000}, 224), DetectorLayout::kAuto);          // a classifier
  EXPECT_EQ(Guess({1, 19, 128, 128}, 512), DetectorLayout::kAuto);  // a segmentation
  EXPECT_EQ(Guess({1, 197, 768}, 224), DetectorLayout::kAuto);      // a transformer's tokens
  EXPECT_EQ(Guess({2, 25200, 85}), DetectorLayout::kAuto);          // a batch of two
}

// One candidate in an output, by the metadata where there are any.
struct OneBox {
  const char* what;
  std::vector<int> shape;
  int candidate;
  std::vector<float> numbers;
  HeadMetadata head;
  DetectorLayout layout;
  int category;
  Box box;
};

std::vector<float> WithScore(std::vector<float> box, int classes, int category,
                             const std::vector<float>& rest = {}) {
  box.resize(4 + static_cast<size_t>(classes));
  box[4 + static_cast<size_t>(category)] = 0.9F;
  box.insert(box.end(), rest.begin(), rest.end());
  return box;
}

std::vector<OneBox> OtherHeads() {
  const auto head = [](int names, const char* task, int keypoint_values = 0) {
    HeadMetadata made = HeadOf(names);
    made.task = task;
    made.keypoint_values = keypoint_values;
    return made;
  };
  HeadMetadata rt_detr = head(80, "detect"), flagged = head(80, "pose");
  rt_detr.is_rt_detr = true;
  flagged.is_suppressed = true;
  constexpr auto kV8 = DetectorLayout::kYolov8, kListed = DetectorLayout::kEndToEnd,
                 kDetr = DetectorLayout::kRtDetr;
  const Box box{200, 260, 300, 340}, share{200, 240, 300, 320};  // input 640x640
  const std::vector<float> centre{250, 300, 100, 80}, shares{0.390625F, 0.4375F, 0.15625F, 0.125F};
  const std::vector<float> points(51, 290.5F);
  // Turned by 90 degrees, an oriented box of 100 x 80 is one of 80 x 100.
  const float quarter = std::numbers::pi_v<float> / 2;
  const Box turned{210, 250, 290, 350};
  return {
      {"pose",
       {1, 56, 8400},
       4000,
       WithScore(centre, 1, 0, points),
       head(1, "pose", 51),
       kV8,
       0,
       box},
      {"oriented",
       {1, 20, 8400},
       4000,
       WithScore(centre, 15, 3, {quarter}),
       head(15, "obb"),
       kV8,
       3,
       turned},
      {"pose, listed",
       {1, 300, 57},
       0,
       WithScore({200, 260, 300, 340}, 1, 0,
                 [&] {
                   std::vector<float> rest{0};
                   rest.insert(rest.end(), points.begin(), points.end());
                   return rest;
                 }()),
       head(1, "pose", 51),
       kListed,
       0,
       box},
      {"pose, listed, without the number of keypoints",
       {1, 300, 57},
       0,
       {200, 260, 300, 340, 0.9F, 7, 290.5F},
       flagged,
       kListed,
       7,
       box},
      {"segmentation, listed, without prototypes",
       {1, 300, 38},
       0,
       {200, 260, 300, 340, 0.9F, 7, 2.5F},
       head(80, "segment"),
       kListed,
       7,
       box},
      {"oriented, listed",
       {1, 300, 7},
       0,
       {250, 300, 100, 80, 0.9F, 3, quarter},
       head(15, "obb"),
       kListed,
       3,
       turned},
      {"RT-DETR, with class",
       {1, 300, 6},
       0,
       {shares[0], shares[1], shares[2], shares[3], 0.9F, 41},
       rt_detr,
       kDetr,
       41,
       share},
      {"RT-DETR, with class, unnamed",
       {1, 300, 6},
       0,
       {shares[0], shares[1], shares[2], shares[3], 0.9F, 41},
       HeadOf(0),
       kDetr,
       41,
       share},
      {"RT-DETR", {1, 300, 84}, 0, WithScore(shares, 80, 41), head(80, "detect"), kDetr, 41, share},
      {"RT-DETR, unnamed", {1, 300, 84}, 0, WithScore(shares, 80, 41), HeadOf(0), kDetr, 41, share},
      {"RT-DETR, two classes",
       {1, 300, 6},
       0,
       WithScore(shares, 2, 1),
       head(2, "detect"),
       kDetr,
       1,
       share},
      {"transposed", {1, 8400, 84}, 4000, WithScore(centre, 80, 41), HeadOf(80), kV8, 41, box},
      {"transposed, unnamed",
       {1, 8400, 84},
       4000,
       WithScore(centre, 80, 41),
       HeadOf(0),
       kV8,
       41,
       box},
      {"transposed, one class",
       {1, 8400, 5},
       4000,
       WithScore(centre, 1, 0),
       HeadOf(0),
       kV8,
       0,
       box},
      {"transposed pose",
       {1, 8400, 56},
       4000,
       WithScore(centre, 1, 0, points),
       head(1, "pose", 51),
       kV8,
       0,
       box},
  };
}

TEST(YoloOutput, ReadsTheBoxesOfOtherHeads) {
  for (const OneBox& one : OtherHeads()) {
    SCOPED_TRACE(one.what);
    cv::Mat tensor(one.shape, CV_32F, cv::Scalar(0));
    const bool is_column = one.shape[2] == 8400;
    for (size_t i = 0; i < one.numbers.size(); ++i) {
      const int number = static_cast<int>(i);
      At(tensor, is_column ? number : one.candidate, is_column ? one.candidate : number) =
          one.numbers[i];
    }
    const auto format = RecognizeOutput(tensor, {640, 640}, DetectorLayout::kAuto, one.head);
    ASSERT_TRUE(format);
    EXPECT_EQ(ToString(format->layout), std::string(ToString(one.layout)));
    const auto found = DecodeOutput(tensor, *format, {640, 640}, 0.3);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].category_id, one.category);
    EXPECT_NEAR(found[0].score, 0.9, 1e-6);
    ExpectBox(found[0].box, one.box.x1, one.box.y1, one.box.x2, one.box.y2);
    LayoutCheck check;
    EXPECT_EQ(check.Add(tensor, *format, {640, 640}, found), "");
  }
}

TEST(YoloOutput, MoreMasksThanNumbersAreNoSegmentation) {
  HeadMetadata head = HeadOf(3);
  head.task = "segment";
  EXPECT_FALSE(RecognizeOutput(Tensor(300, 30), {640, 640}, DetectorLayout::kAuto, head, 32));
}

TEST(YoloOutput, AnOverrideIsCheckedAgainstTheShape) {
  const cv::Size size(640, 640);
  EXPECT_EQ(Recognize({1, 8400, 85}, size, DetectorLayout::kYolov5, 0, false)->classes,
            80);  // YOLOv6
  EXPECT_FALSE(Recognize({1, 25200, 85}, size, DetectorLayout::kYolox, 0, false));
  EXPECT_FALSE(Recognize({1, 84, 8400}, size, DetectorLayout::kEndToEnd, 0, false));
}

TEST(YoloOutput, KeepsTheLabelsNextToTheBest) {
  cv::Mat rows = Tensor(3 * kCells, 5 + kClasses);
  FillRow(rows, 5, {30, 20, 10, 4, 0.5F, 0.4F, 0.8F, 0.1F});  // the last one says nothing
  const auto v5 = DecodeOutput(rows, {DetectorLayout::kYolov5, kClasses}, kYoloInput, 0.3);
  ASSERT_EQ(v5.size(), 1u);
  ASSERT_EQ(v5[0].other_labels.size(), 1u);
  EXPECT_EQ(v5[0].other_labels[0].category_id, 0);
  EXPECT_NEAR(v5[0].other_labels[0].score, 0.2, 1e-6);
  cv::Mat columns = Tensor(4 + kClasses, kCells);
  const std::vector<float> column{30, 20, 10, 4, 0.3F, 0.5F, 0.9F};
  for (size_t i = 0; i < column.size(); ++i) At(columns, static_cast<int>(i), 17) = column[i];
  const auto v8 = DecodeOutput(columns, {DetectorLayout::kYolov8, kClasses}, kYoloInput, 0.3);
  ASSERT_EQ(v8.size(), 1u);
  ASSERT_EQ(v8[0].other_labels.size(), 2u);
  EXPECT_EQ(v8[0].other_labels[0].category_id, 1);
  EXPECT_EQ(v8[0].other_labels[1].category_id, 0);
}

TEST(YoloOutput, JoinsTheLabelsOfOneBox) {
  const Box box{10, 10, 20, 20};
  const Box shifted{11, 10, 21, 20};  // IoU 9/11
  Candidate cup{{.category_id = 41, .score = 0.9, .box = box, .other_labels = {{45, 0.2}}}};
  const Candidate bowl{{.category_id = 45, .score = 0.6, .box = shifted}};
  const Candidate other{{.category_id = 60, .score = 0.5, .box = box}};
  const Candidate far{{.category_id = 45, .score = 0.4, .box = {30, 10, 40, 20}}};
  const auto joined = JoinLabels({cup, bowl, other, far});
  ASSERT_EQ(joined.size(), 3u);
  EXPECT_EQ(joined[0].other_labels, (std::vector<Label>{{45, 0.6}}));
  EXPECT_EQ(joined[1].category_id, 60);
  EXPECT_EQ(joined[2].category_id, 45);
}

TEST(YoloOutput, NamesOfLayoutsGoBothWays) {
  for (const char* name : {"auto", "yolox", "yolov5", "yolov8", "end2end", "rtdetr"})
    EXPECT_STREQ(ToString(DetectorLayoutFromString(name).value()), name);
  EXPECT_FALSE(DetectorLayoutFromString("yolo"));
}

TEST(YoloOutput, SuppressesWithinAClassOnly) {
  const Box box{10, 10, 20, 20};
  const Box shifted{11, 10, 21, 20};  // IoU 9/11
  const Box apart{30, 10, 40, 20};
  const auto kept = SuppressPerClass({{{.category_id = 1, .score = 0.5, .box = box}},
                                      {{.category_id = 1, .score = 0.9, .box = shifted}},
                                      {{.category_id = 2, .score = 0.6, .box = box}},
                                      {{.category_id = 1, .score = 0.4, .box = apart}}},
                                     0.5);
  ASSERT_EQ(kept.size(), 3u);
  EXPECT_DOUBLE_EQ(kept[0].score, 0.9);
  EXPECT_DOUBLE_EQ(kept[1].score, 0.6);
  EXPECT_DOUBLE_EQ(kept[2].score, 0.4);
}

}  // namespace
}  // namespace oaslam
