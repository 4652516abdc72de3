#include "oaslam/detection/onnx_info.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

// Protobuf by hand: a field of bytes, a field of a number.
std::string Bytes(int id, const std::string& content) {
  return std::string{static_cast<char>(id << 3 | 2), static_cast<char>(content.size())} + content;
}
std::string Number(int id, int value) {
  return {static_cast<char>(id << 3), static_cast<char>(value)};
}

std::string Input(const std::string& name, const std::vector<std::string>& dims) {
  std::string shape;
  for (const std::string& dim : dims) shape += Bytes(1, dim);
  return Bytes(11, Bytes(1, name) + Bytes(2, Bytes(1, Number(1, 1) + Bytes(2, shape))));
}

std::string Model() {
  const std::string weight = Bytes(5, Bytes(8, "weight"));
  const std::string graph =
      weight + Input("weight", {Number(1, 7)}) +
      Input("images", {Number(1, 1), Number(1, 3), Bytes(2, "height"), Number(1, 96)});
  return Number(1, 8) + Bytes(7, graph) + Bytes(14, Bytes(1, "names") + Bytes(2, "{0: 'cup'}"));
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
  EXPECT_EQ(ParseNamesMetadata(R"({0: 'person', 12: "baby's bed", 3: 'it\'s'})"),
            (std::map<int, std::string>{{0, "person"}, {12, "baby's bed"}, {3, "it's"}}));
  EXPECT_TRUE(ParseNamesMetadata("['person']").empty());
  EXPECT_TRUE(ParseNamesMetadata("{0: 'person").empty());
  EXPECT_TRUE(ParseNamesMetadata("").empty());
}

}  // namespace
}  // namespace oaslam
