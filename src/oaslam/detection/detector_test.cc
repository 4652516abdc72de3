#include "oaslam/detection/detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "oaslam/error.h"
#include "oaslam_data.h"

namespace oaslam {
namespace {

constexpr char kModel[] = OASLAM_SOURCE_DIR "/data/models/yolox_nano.onnx";

double Iou(const Box& a, const Box& b) {
  const Box both{std::max(a.x1, b.x1), std::max(a.y1, b.y1), std::min(a.x2, b.x2),
                 std::min(a.y2, b.y2)};
  return both.Area() / (a.Area() + b.Area() - both.Area());
}

std::string ErrorOf(const std::string& path, const DetectorOptions& options = {}) {
  try {
    Detector::Load(path, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Detector, RefusesFilesThatAreNoDetector) {
  EXPECT_THAT(ErrorOf("/nowhere/model.onnx"),
              ::testing::HasSubstr("/nowhere/model.onnx: cannot read"));
  const std::filesystem::path text =
      std::filesystem::temp_directory_path() / "oaslam_no_detector.onnx";
  std::ofstream(text) << "a text file";
  EXPECT_THAT(ErrorOf(text), ::testing::HasSubstr("not an ONNX file"));
  std::filesystem::remove(text);
}

// The detections.json of the sequence was made with this model (see its README):
// we must find the same.
TEST(Detector, FindsWhatTheModelFoundBefore) {
  OASLAM_SKIP_WITHOUT_DATA("redkitchen/rgb");
  const auto detector = Detector::Load(kModel);
  EXPECT_EQ(detector->layout(), DetectorLayout::kYolox);
  EXPECT_EQ(detector->input_size(), cv::Size(416, 416));
  EXPECT_EQ(detector->class_count(), 80);

  const auto all =
      nlohmann::json::parse(std::ifstream(*testing::FindData("redkitchen/detections.json")));
  for (const size_t frame : {0, 500, 990}) {
    const auto& expected = all.at(frame);
    const std::string name = expected.at("file_name");
    const cv::Mat image = cv::imread(*testing::FindData("redkitchen/rgb/" + name));
    ASSERT_FALSE(image.empty());
    const std::vector<Detection> found = detector->Detect(image);
    EXPECT_EQ(found.size(), expected.at("detections").size()) << name;
    for (const auto& e : expected.at("detections")) {
      const std::vector<double> b = e.at("bbox");
      const bool matched = std::ranges::any_of(found, [&](const Detection& d) {
        return d.category_id == e.at("category_id") &&
               Iou(d.box, {b[0], b[1], b[2], b[3]}) > 0.97 &&
               std::abs(d.score - e.at("detection_score").get<double>()) < 0.02;
      });
      EXPECT_TRUE(matched) << name << " " << e;
    }
  }
}

TEST(Detector, AnOverrideThatDoesNotFitIsRefused) {
  const std::string path = kModel;
  EXPECT_THAT(ErrorOf(path, {.layout = DetectorLayout::kYolov8}),
              ::testing::HasSubstr("not a detector of layout 'yolov8'"));
  EXPECT_THAT(ErrorOf(path, {.input_size = {640, 640}}), ::testing::HasSubstr("made for 416"));
}

TEST(Detector, ATruncatedModelIsRefused) {
  std::ifstream whole(kModel, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(whole), {}};
  const std::filesystem::path half = std::filesystem::temp_directory_path() / "oaslam_half.onnx";
  std::ofstream(half, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  EXPECT_THAT(ErrorOf(half), ::testing::HasSubstr("not an ONNX file, or a damaged one"));
  std::filesystem::remove(half);
}

}  // namespace
}  // namespace oaslam
