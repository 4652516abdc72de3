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

}  // namespace
}  // namespace oaslam
