#include "oaslam/detection/onnx_info.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>

#define PROTOZERO_USE_VIEW std::string_view
#include <protozero/exception.hpp>
#include <protozero/pbf_reader.hpp>

namespace oaslam {
namespace {

using protozero::pbf_reader;
constexpr auto kBytes = protozero::pbf_wire_type::length_delimited;

// The first field `id` of a message that is a text or a message; empty where there is none.
std::string_view FirstOf(std::string_view message, uint32_t id) {
  pbf_reader fields(message);
  return fields.next(id, kBytes) ? fields.get_view() : std::string_view{};
}

// Field numbers below are those of onnx.proto3 (github.com/onnx/onnx, Apache-2.0).
std::vector<int64_t> ShapeOfValue(std::string_view value_info) {
  std::vector<int64_t> shape;
  const std::string_view type = FirstOf(value_info, 2), tensor = FirstOf(type, 1);
  pbf_reader dimensions(FirstOf(tensor, 2));
  while (dimensions.next(1, kBytes)) {
    pbf_reader dimension = dimensions.get_message();
    int64_t size = 0;  // one that has a name instead of a size is open
    while (dimension.next(1, protozero::pbf_wire_type::varint)) size = dimension.get_int64();
    shape.push_back(std::max<int64_t>(size, 0));
  }
  return shape;
}

// The product of a list such as [17, 3]; 0 for other text.
int ProductOf(const std::string& text) try {
  constexpr int kMost = 10'000;  // more than any network has
  int product = 1;
  const YAML::Node list = YAML::Load(text);
  for (const auto& size : list) {
    const int factor = size.as<int>();
    if (factor < 1 || factor > kMost / product) return 0;
    product *= factor;
  }
  return list.IsSequence() && list.size() > 0 ? product : 0;
} catch (const YAML::Exception&) {
  return 0;
}

// Whether a dictionary, as {'batch': 1, 'nms': True}, has the value true for this key.
bool IsTrueIn(const std::string& dictionary, const char* key) try {
  const YAML::Node node = YAML::Load(dictionary);
  return node.IsMap() && node[key] && node[key].as<bool>();
} catch (const YAML::Exception&) {
  return false;
}

}  // namespace

std::optional<OnnxInfo> ParseOnnxInfo(std::string_view bytes) try {
  OnnxInfo info;
  std::vector<std::string_view> graphs, inputs;
  std::set<std::string_view> weights;  // that older exporters list among the inputs
  for (pbf_reader model(bytes); model.next();) {
    const bool is_bytes = model.wire_type() == kBytes;
    if (is_bytes && model.tag() == 7) {
      graphs.push_back(model.get_view());
    } else if (is_bytes && model.tag() == 14) {
      const std::string_view entry = model.get_view();
      info.metadata[std::string(FirstOf(entry, 1))] = FirstOf(entry, 2);
    } else {
      model.skip();
    }
  }
  if (graphs.size() != 1) return std::nullopt;
  for (pbf_reader graph(graphs.front()); graph.next();) {
    const bool is_bytes = graph.wire_type() == kBytes;
    if (is_bytes && graph.tag() == 5)
      weights.insert(FirstOf(graph.get_view(), 8));
    else if (is_bytes && graph.tag() == 11)
      inputs.push_back(graph.get_view());
    else
      graph.skip();
  }
  const auto input = std::ranges::find_if(inputs, [&](std::string_view value_info) {
    return !weights.contains(FirstOf(value_info, 1));
  });
  if (input == inputs.end()) return std::nullopt;
  info.input_shape = ShapeOfValue(*input);
  return info;
} catch (const protozero::exception&) {
  return std::nullopt;
}

std::map<int, std::string> ParseNamesMetadata(std::string_view text) try {
  // In a name with quotes of both kinds, Python escapes the single ones, and YAML doubles them.
  std::string yaml(text);
  for (size_t at = 0; (at = yaml.find("\\'", at)) != std::string::npos;) yaml[at] = '\'';
  std::map<int, std::string> names;
  const YAML::Node dictionary = YAML::Load(yaml);
  if (!dictionary.IsMap()) return {};
  for (const auto& entry : dictionary) {
    const int id = entry.first.as<int>();
    if (id < 0) return {};
    names[id] = entry.second.as<std::string>();
  }
  return names;
} catch (const YAML::Exception&) {
  return {};
}

HeadMetadata ParseHeadMetadata(const std::map<std::string, std::string>& metadata) {
  const auto value = [&](const char* key) {
    const auto found = metadata.find(key);
    return found == metadata.end() ? std::string() : found->second;
  };
  HeadMetadata head;
  head.task = value("task");
  head.names = ParseNamesMetadata(value("names"));
  head.keypoint_values = ProductOf(value("kpt_shape"));
  head.is_suppressed = value("end2end") == "True" || IsTrueIn(value("args"), "nms");
  head.is_rt_detr = value("head") == "RTDETRDecoder";
  return head;
}

}  // namespace oaslam
