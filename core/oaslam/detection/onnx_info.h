#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// Information in an ONNX file that does not depend on the library that runs its network.
struct OnnxInfo {
  // The shape of the first input that is no weight; 0 for a dimension that the file leaves open.
  std::vector<int64_t> input_shape;
  std::map<std::string, std::string> metadata;  // metadata_props
};

// Reads the information from the bytes of an ONNX file (a protobuf ModelProto); nothing where they
// are malformed or have no graph with an input.
std::optional<OnnxInfo> ParseOnnxInfo(std::string_view bytes);

// A dictionary of class names as exporters write it into the metadata: {0: 'person', 1: "baby's
// bed"}. Returns an empty map for other text.
std::map<int, std::string> ParseNamesMetadata(std::string_view text);

// What an exporter says in the metadata of a file about the output of a network; empty where it
// says nothing. The keys are those of Ultralytics' exports, which other exporters write, too.
struct HeadMetadata {
  std::string task;                  // "detect", "segment", "pose", "obb", "classify"
  std::map<int, std::string> names;  // of the classes
  int keypoint_values = 0;           // numbers for the keypoints of one candidate
  bool is_suppressed = false;        // the network drops overlapping boxes itself
  bool is_rt_detr = false;
};

HeadMetadata ParseHeadMetadata(const std::map<std::string, std::string>& metadata);

}  // namespace oaslam
