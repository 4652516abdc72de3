#include "oaslam/detector.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "expect_input_error.h"
#include "oaslam/detection/network.h"
#include "oaslam_data.h"
#include "onnx_file.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

// YOLOX-nano, under OASLAM_DATA.
constexpr char kModel[] = "models/yolox_nano.onnx";

std::string ModelPath() { return testing::FindData(kModel)->string(); }

double Iou(const Box& a, const Box& b) {
  const Box both{std::max(a.x1, b.x1), std::max(a.y1, b.y1), std::min(a.x2, b.x2),
                 std::min(a.y2, b.y2)};
  return both.Area() / (a.Area() + b.Area() - both.Area());
}

std::string ErrorOf(const std::string& path, const DetectorOptions& options = {}) {
  return InputErrorOf([&] { Detector::Load(path, options); });
}

// Small networks: an input of any size, and rows of six numbers for any number of boxes.
std::string Images() {
  using testing::Dimension;
  return testing::GraphEnd(11, "images",
                           {Dimension(1), Dimension(3), Dimension("rows"), Dimension("columns")});
}

std::string BoxesOfAnyNumber() {
  return testing::GraphEnd(12, "boxes", {testing::Dimension("boxes"), testing::Dimension(6)});
}

// Three boxes, of which the second overlaps the first; their scores are 0.9, 0.8 and 0.7 times the
// brightest value of the image, and those of 0.5 or less are dropped.
std::string SuppressionByBrightness() {
  using testing::Constant, testing::IntConstant, testing::Node;
  return Node("ReduceMax", {"images"}, "brightest", testing::IntAttribute("keepdims", 0)) +
         Node("Mul", {"best", "brightest"}, "scores") +
         Node("NonMaxSuppression", {"places", "scores", "most", "most_overlap", "least_score"},
              "kept") +
         Node("Gather", {"kept", "column"}, "kept_rows", testing::IntAttribute("axis", 1)) +
         Node("Gather", {"rows", "kept_rows"}, "boxes") +
         Constant("best", {1, 1, 3}, {0.9F, 0.8F, 0.7F}) +
         Constant("places", {1, 3, 4}, {10, 10, 30, 30, 11, 11, 31, 31, 40, 40, 60, 60}) +
         Constant("rows", {3, 6},
                  {10, 10, 30, 30, 0.9F, 5,  //
                   11, 11, 31, 31, 0.8F, 6,  //
                   40, 40, 60, 60, 0.7F, 7}) +
         IntConstant("most", {1}, {10}) + IntConstant("column", {}, {2}) +
         Constant("most_overlap", {1}, {0.5F}) + Constant("least_score", {1}, {0.5F});
}

// A network that finds the same in every image: an input of 64 x 64, an output of these numbers.
std::string ConstantNetwork(const std::vector<uint64_t>& shape, const std::vector<float>& numbers,
                            const std::map<std::string, std::string>& metadata = {}) {
  using testing::Constant, testing::Dimension, testing::Node;
  size_t size = 1;
  std::vector<std::string> dimensions;
  for (const uint64_t length : shape) {
    size *= length;
    dimensions.push_back(Dimension(length));
  }
  std::vector<float> all(numbers);
  all.resize(size);
  std::string file = testing::OnnxFile(
      Node("GlobalAveragePool", {"images"}, "mean") +
      Node("Conv", {"mean", "none", "all"}, "flat",
           testing::IntsAttribute("kernel_shape", {1, 1})) +
      Node("Reshape", {"flat", "shape"}, "output0") +
      Constant("none", {size, 3, 1, 1}, std::vector<float>(3 * size)) +
      Constant("all", {size}, all) + testing::IntConstant("shape", {shape.size()}, shape) +
      testing::GraphEnd(11, "images", {Dimension(1), Dimension(3), Dimension(64), Dimension(64)}) +
      testing::GraphEnd(12, "output0", dimensions));
  for (const auto& [key, value] : metadata)
    file += testing::Bytes(14, testing::Bytes(1, key) + testing::Bytes(2, value));
  return file;
}

class DetectorBy : public ::testing::TestWithParam<NetworkBackend> {
 protected:
  void SetUp() override {
    if (!IsBuiltIn(GetParam())) GTEST_SKIP() << ToString(GetParam()) << " is not built in";
  }
};

TEST(Detector, RefusesFilesThatAreNoDetector) {
  EXPECT_THAT(ErrorOf("/nowhere/model.onnx"),
              HasSubstr("/nowhere/model.onnx: there is no such file"));
  const TempFolder folder;
  EXPECT_THAT(ErrorOf(folder.Write("text.onnx", "a text file")), HasSubstr("not an ONNX file"));
  EXPECT_THAT(ErrorOf(folder.path()), HasSubstr("is a folder"));
}

TEST(Detector, TakesImagesOfEightBitsAndNoOthers) {
  OASLAM_SKIP_WITHOUT_DATA(kModel);
  const auto detector = Detector::Load(ModelPath());
  for (const cv::Mat& image : {cv::Mat(), cv::Mat(48, 64, CV_16UC1), cv::Mat(48, 64, CV_8UC2)})
    EXPECT_INPUT_ERROR(detector->Detect(image), HasSubstr("8-bit"));
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4})
    EXPECT_TRUE(detector->Detect(cv::Mat(48, 64, type, cv::Scalar::all(90))).empty());
}

// The detections.json of the sequence was made with this model (see its README):
// we must find the same.
TEST_P(DetectorBy, FindsWhatTheModelFoundBefore) {
  OASLAM_SKIP_WITHOUT_DATA("redkitchen/rgb");
  OASLAM_SKIP_WITHOUT_DATA(kModel);
  const auto detector = Detector::Load(ModelPath(), {.backend = GetParam()});
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

TEST_P(DetectorBy, AnOverrideThatDoesNotFitIsRefused) {
  OASLAM_SKIP_WITHOUT_DATA(kModel);
  const std::string path = ModelPath();
  EXPECT_THAT(ErrorOf(path, {.layout = DetectorLayout::kYolov8, .backend = GetParam()}),
              HasSubstr("not a detector of layout 'yolov8'"));
  EXPECT_THAT(ErrorOf(path, {.input_size = {640, 640}, .backend = GetParam()}),
              HasSubstr("made for 416"));
}

TEST_P(DetectorBy, ANetworkThatTheLibraryCannotRunIsRefused) {
  const TempFolder folder;
  const std::string path = folder.Write(
      "network.onnx", testing::OnnxFile(testing::Node("NoSuchOperation", {"images"}, "boxes") +
                                        Images() + BoxesOfAnyNumber()));
  EXPECT_THAT(ErrorOf(path, {.backend = GetParam()}),
              AllOf(StartsWith(path + ": "), HasSubstr(" cannot run this network: "),
                    HasSubstr("NoSuchOperation")));
}

TEST_P(DetectorBy, RtDetrGetsTheImageStretched) {
  const TempFolder folder;
  const auto detector =
      Detector::Load(folder.Write("network.onnx",
                                  ConstantNetwork({1, 300, 6}, {0.5F, 0.25F, 0.5F, 0.25F, 0.9F, 41},
                                                  {{"head", "RTDETRDecoder"}})),
                     {.backend = GetParam()});
  EXPECT_EQ(detector->layout(), DetectorLayout::kRtDetr);
  const auto found = detector->Detect(cv::Mat(40, 120, CV_8UC3, cv::Scalar::all(9)));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].category_id, 41);
  EXPECT_NEAR(found[0].box.x1, 30, 1e-4);
  EXPECT_NEAR(found[0].box.y1, 5, 1e-4);
  EXPECT_NEAR(found[0].box.x2, 90, 1e-4);
  EXPECT_NEAR(found[0].box.y2, 15, 1e-4);
}

TEST_P(DetectorBy, OtherKindsOfNetworksAreRefusedByName) {
  const TempFolder folder;
  const auto error = [&](const std::vector<uint64_t>& shape,
                         const std::map<std::string, std::string>& metadata = {}) {
    return ErrorOf(folder.Write("network.onnx", ConstantNetwork(shape, {}, metadata)),
                   {.backend = GetParam()});
  };
  EXPECT_THAT(error({1, 6}, {{"task", "classify"}}), HasSubstr("a classification network"));
  EXPECT_THAT(error({1, 1000}),
              HasSubstr("outputs [1, 1000] for an input of 64x64 (a classification, or"));
  EXPECT_THAT(error({1, 19, 16, 16}), HasSubstr("(a segmentation without boxes, or grids"));
  EXPECT_THAT(error({1, 19, 16, 16}, {{"task", "semantic"}}), HasSubstr("; task 'semantic')"));
}

TEST_P(DetectorBy, AnOutputThatContradictsTheLayoutIsRefused) {
  const TempFolder folder;
  const auto write = [&](const std::vector<uint64_t>& shape, const std::vector<float>& numbers) {
    return folder.Write("network.onnx", ConstantNetwork(shape, numbers));
  };
  // 84 candidates; of a network for keypoints, the first number behind the class is one of pixels.
  std::vector<float> columns(6 * 84);
  columns[5 * 84] = 290.5F;
  EXPECT_THAT(ErrorOf(write({1, 6, 84}, columns), {.backend = GetParam()}),
              HasSubstr("its output [1, 6, 84] was taken for layout 'yolov8' of 2 classes, but "
                        "gives a score of 290.5, allowed: 0 to 1"));
  // Normalised corners.
  const auto corners = Detector::Load(write({1, 300, 6}, {0.2F, 0.3F, 0.4F, 0.5F, 0.9F, 41}),
                                      {.backend = GetParam()});
  EXPECT_INPUT_ERROR(
      corners->Detect(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(9))),
      HasSubstrs("network.onnx", "layout 'end2end'", "1 of 1 boxes of the first images"));
}

INSTANTIATE_TEST_SUITE_P(, DetectorBy,
                         ::testing::Values(NetworkBackend::kOnnxRuntime, NetworkBackend::kOpenCv),
                         [](const auto& test) { return std::string(ToString(test.param)); });

TEST(Detector, ALibraryThatIsNotBuiltInIsRefused) {
  if (IsBuiltIn(NetworkBackend::kOnnxRuntime)) GTEST_SKIP() << "all are built in";
  OASLAM_SKIP_WITHOUT_DATA(kModel);
  EXPECT_THAT(
      ErrorOf(ModelPath(), {.backend = NetworkBackend::kOnnxRuntime}),
      AllOf(StartsWith(ModelPath()), HasSubstr("onnxruntime is not built in, only OpenCV")));
}

// OpenCV's importer knows no suppression inside of a network.
TEST(Detector, OnnxRuntimeRunsANetworkWithOpenShapes) {
  if (!IsBuiltIn(NetworkBackend::kOnnxRuntime)) GTEST_SKIP() << "ONNX Runtime is not built in";
  const TempFolder folder;
  const std::string path = folder.Write(
      "network.onnx", testing::OnnxFile(SuppressionByBrightness() + Images() + BoxesOfAnyNumber()));
  const auto detector =
      Detector::Load(path, {.input_size = {64, 96}, .backend = NetworkBackend::kOnnxRuntime});
  EXPECT_EQ(detector->layout(), DetectorLayout::kEndToEnd);
  EXPECT_EQ(detector->input_size(), cv::Size(64, 96));
  EXPECT_THAT(detector->Detect(cv::Mat(96, 64, CV_8UC3, cv::Scalar::all(10))), IsEmpty());
  const auto found = detector->Detect(cv::Mat(96, 64, CV_8UC3, cv::Scalar::all(255)));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].category_id, 5);
  EXPECT_EQ(found[1].category_id, 7);
  EXPECT_NEAR(found[1].box.x2, 60, 1e-4);
}

// Both compute with floats of 32 bits, in an order of their own.
TEST(Detector, BothLibrariesFindTheSame) {
  if (!IsBuiltIn(NetworkBackend::kOnnxRuntime)) GTEST_SKIP() << "ONNX Runtime is not built in";
  OASLAM_SKIP_WITHOUT_DATA(kModel);
  constexpr double kPixels = 0.1, kScore = 0.001;
  const auto first = Detector::Load(ModelPath(), {.backend = NetworkBackend::kOnnxRuntime});
  const auto second = Detector::Load(ModelPath(), {.backend = NetworkBackend::kOpenCv});
  size_t compared = 0;
  for (const char* const clip : {"map_front", "loop", "query_around"}) {
    cv::VideoCapture video(std::string(OASLAM_SOURCE_DIR "/data/sample/") + clip + "/video.mp4");
    cv::Mat image;
    for (int i = 0; i < 200 && video.read(image); ++i) {
      if (i % 40 != 0) continue;
      const std::vector<Detection> a = first->Detect(image), b = second->Detect(image);
      ASSERT_EQ(a.size(), b.size()) << clip << " " << i;
      for (size_t k = 0; k < a.size(); ++k) {
        EXPECT_EQ(a[k].category_id, b[k].category_id) << clip << " " << i;
        EXPECT_NEAR(a[k].score, b[k].score, kScore) << clip << " " << i;
        EXPECT_NEAR(a[k].box.x1, b[k].box.x1, kPixels) << clip << " " << i;
        EXPECT_NEAR(a[k].box.y1, b[k].box.y1, kPixels) << clip << " " << i;
        EXPECT_NEAR(a[k].box.x2, b[k].box.x2, kPixels) << clip << " " << i;
        EXPECT_NEAR(a[k].box.y2, b[k].box.y2, kPixels) << clip << " " << i;
      }
      compared += a.size();
    }
  }
  EXPECT_GT(compared, 30u);
}

TEST(Detector, ATruncatedModelIsRefused) {
  OASLAM_SKIP_WITHOUT_DATA(kModel);
  std::ifstream whole(ModelPath(), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(whole), {}};
  const TempFolder folder;
  EXPECT_THAT(ErrorOf(folder.Write("half.onnx", bytes.substr(0, bytes.size() / 2))),
              HasSubstr("not an ONNX file, or a damaged one"));
}

}  // namespace
}  // namespace oaslam
