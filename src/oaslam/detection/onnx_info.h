#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// What an ONNX file says of itself and OpenCV's importer keeps to itself.
struct OnnxInfo {
  std::vector<int64_t> input_shape;  // of the first true input; 0 for a dimension that is left open
  std::map<std::string, std::string> metadata;  // metadata_props
};

// Reads the few fields from the bytes of an ONNX file (a protobuf ModelProto); nothing where they
// are none, or have no graph with an input.
std::optional<OnnxInfo> ParseOnnxInfo(std::string_view bytes);

// A dictionary of class names as exporters write it into the metadata: {0: 'person', 1: "baby's
// bed"}. Empty where it is none.
std::map<int, std::string> ParseNamesMetadata(std::string_view text);

}  // namespace oaslam
