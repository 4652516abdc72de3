#include "oaslam/detection/onnx_info.h"

#include <gtest/gtest.h>

#include "onnx_file.h"

namespace oaslam {
namespace {

using testing::Bytes;
using testing::Dimension;

std::string Model() {
  return testing::OnnxFile(
      testing::Constant("weight", {7}, std::vector<float>(7)) +
          testing::GraphEnd(11, "weight", {Dimension(7)}) +
          testing::GraphEnd(11, "images",
                            {Dimension(1), Dimension(3), Dimension("height"), Dimension(96)}),
      "names", "{0: 'cup'}");
}

TEST(OnnxInfo, ReadsShapeAndMetadata) {
  const auto info = ParseOnnxInfo(Model());
  ASSERT_TRUE(info);
  EXPECT_EQ(info->input_shape, (std::vector<int64_t>{1, 3, 0, 96}));
  EXPECT_EQ(info->metadata.at("names"), "{0: 'cup'}");
}

TEST(OnnxInfo, RefusesWhatIsNone) {
  EXPECT_FALSE(ParseOnnxInfo(""));
  EXPECT_FALSE(ParseOnnxInfo("a text file, for example"));
  EXPECT_FALSE(ParseOnnxInfo(std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16)));
}

TEST(OnnxInfo, EveryTruncationIsSafe) {
  const std::string model = Model();
  const size_t metadata = Bytes(14, Bytes(1, "names") + Bytes(2, "{0: 'cup'}")).size();
  for (size_t size = 0; size < model.size(); ++size) {
    const bool whole_but_metadata = size == model.size() - metadata;
    EXPECT_EQ(ParseOnnxInfo(std::string_view(model).substr(0, size)).has_value(),
              whole_but_metadata)
        << size;
  }
}

TEST(OnnxInfo, ReadsNames) {
  EXPECT_EQ(ParseNamesMetadata(
                R"({0: 'person', 12: "baby's bed", 3: '19" rack, it\'s "new"', 4: 'añb: c'})"),
            (std::map<int, std::string>{
                {0, "person"}, {12, "baby's bed"}, {3, "19\" rack, it's \"new\""}, {4, "añb: c"}}));
  for (const std::string& text :
       {std::string(), std::string("['person']"), std::string("{0: 'person"), std::string("person"),
        std::string("{'a': 'person'}"), std::string("{-1: 'person'}"), std::string("{0: ['a']}"),
        std::string("{99999999999: 'a'}"), std::string("{0: *a}"), std::string(100'000, '{')})
    EXPECT_TRUE(ParseNamesMetadata(text).empty()) << text.substr(0, 100);
}

TEST(OnnxInfo, ReadsWhatExportersSayOfTheHead) {
  const HeadMetadata pose = ParseHeadMetadata({{"task", "pose"},
                                               {"names", "{0: 'person'}"},
                                               {"kpt_shape", "[17, 3]"},
                                               {"end2end", "False"},
                                               {"args", "{'batch': 1, 'nms': True}"}});
  EXPECT_EQ(pose.task, "pose");
  EXPECT_EQ(pose.names, (std::map<int, std::string>{{0, "person"}}));
  EXPECT_EQ(pose.keypoint_values, 51);
  EXPECT_TRUE(pose.is_suppressed);
  EXPECT_FALSE(pose.is_rt_detr);
  EXPECT_TRUE(ParseHeadMetadata({{"end2end", "True"}}).is_suppressed);
  EXPECT_TRUE(ParseHeadMetadata({{"head", "RTDETRDecoder"}}).is_rt_detr);
  EXPECT_FALSE(ParseHeadMetadata({{"args", R"({"nms": false, "half": null})"}}).is_suppressed);
  for (const char* bad :
       {"", "17", "[]", "[17, -3]", "[17, many]", "[100000, 100000]", "[*a", "{a: 1}"})
    EXPECT_EQ(ParseHeadMetadata({{"kpt_shape", bad}}).keypoint_values, 0) << bad;
  for (const char* bad : {"nms", "{nms: [True]}", "{nms: maybe}", "{*a", "[nms]"})
    EXPECT_FALSE(ParseHeadMetadata({{"args", bad}}).is_suppressed) << bad;
}

}  // namespace
}  // namespace oaslam
