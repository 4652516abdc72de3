#include "oaslam/detection/onnx_info.h"

#include <set>

namespace oaslam {
namespace {

// One field of a protobuf message (protobuf.dev, "Encoding"): a number, or bytes.
struct Field {
  uint32_t id = 0;
  uint64_t number = 0;
  std::string_view bytes{};
};

// Iterates over the fields of a message; stops at its end or at the first malformed byte.
class FieldReader {
 public:
  explicit FieldReader(std::string_view message) : rest_(message) {}

  std::optional<Field> Next() {
    if (rest_.empty()) return std::nullopt;
    const std::optional<uint64_t> key = Varint();
    if (!key || (*key >> 3) == 0 || (*key >> 3) > UINT32_MAX) return Fail();
    Field field{.id = static_cast<uint32_t>(*key >> 3)};
    switch (*key & 7) {
      case 0: {
        const std::optional<uint64_t> value = Varint();
        if (!value) return Fail();
        field.number = *value;
        return field;
      }
      case 1:
        return Take(8, field);
      case 2: {
        const std::optional<uint64_t> size = Varint();
        return size ? Take(*size, field) : Fail();
      }
      case 5:
        return Take(4, field);
      default:
        return Fail();
    }
  }

  bool ok() const { return ok_; }

 private:
  std::optional<Field> Fail() {
    ok_ = false;
    rest_ = {};
    return std::nullopt;
  }

  std::optional<Field> Take(uint64_t size, Field field) {
    if (size > rest_.size()) return Fail();
    field.bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return field;
  }

  std::optional<uint64_t> Varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
      const uint8_t byte = static_cast<uint8_t>(rest_.front());
      rest_.remove_prefix(1);
      value |= static_cast<uint64_t>(byte & 0x7f) << shift;
      if (!(byte & 0x80)) return value;
    }
    return std::nullopt;
  }

  std::string_view rest_;
  bool ok_ = true;
};

// The bytes of all fields `id` of a message; nothing if the message is malformed.
std::optional<std::vector<std::string_view>> FieldsOf(std::string_view message, uint32_t id) {
  std::vector<std::string_view> found;
  FieldReader reader(message);
  while (const std::optional<Field> field = reader.Next())
    if (field->id == id) found.push_back(field->bytes);
  if (!reader.ok()) return std::nullopt;
  return found;
}

std::string_view FirstOf(std::string_view message, uint32_t id) {
  const auto found = FieldsOf(message, id);
  return found && !found->empty() ? found->front() : std::string_view{};
}

// Field numbers below are those of onnx.proto3 (github.com/onnx/onnx, Apache-2.0).
std::vector<int64_t> ShapeOfValue(std::string_view value_info) {
  const std::string_view type = FirstOf(value_info, 2);
  const std::string_view tensor = FirstOf(type, 1);
  std::vector<int64_t> shape;
  for (const std::string_view dim :
       FieldsOf(FirstOf(tensor, 2), 1).value_or(std::vector<std::string_view>{})) {
    FieldReader reader(dim);
    int64_t size = 0;
    while (const std::optional<Field> field = reader.Next())
      if (field->id == 1) size = static_cast<int64_t>(field->number);
    shape.push_back(size > 0 ? size : 0);
  }
  return shape;
}

}  // namespace

std::optional<OnnxInfo> ParseOnnxInfo(std::string_view bytes) {
  const auto graphs = FieldsOf(bytes, 7);
  if (!graphs || graphs->size() != 1) return std::nullopt;
  const std::string_view graph = graphs->front();
  const auto inputs = FieldsOf(graph, 11);
  if (!inputs) return std::nullopt;
  // Older exporters list the weights among the inputs.
  std::set<std::string_view> weights;
  for (const std::string_view tensor : FieldsOf(graph, 5).value_or(std::vector<std::string_view>{}))
    weights.insert(FirstOf(tensor, 8));

  OnnxInfo info;
  bool found = false;
  for (const std::string_view input : *inputs) {
    if (weights.contains(FirstOf(input, 1))) continue;
    info.input_shape = ShapeOfValue(input);
    found = true;
    break;
  }
  if (!found) return std::nullopt;
  for (const std::string_view entry : FieldsOf(bytes, 14).value_or(std::vector<std::string_view>{}))
    info.metadata[std::string(FirstOf(entry, 1))] = std::string(FirstOf(entry, 2));
  return info;
}

std::map<int, std::string> ParseNamesMetadata(std::string_view text) {
  std::map<int, std::string> names;
  size_t at = 0;
  const auto skip = [&](std::string_view characters) {
    while (at < text.size() && characters.find(text[at]) != std::string_view::npos) ++at;
  };
  skip(" {");
  while (at < text.size() && text[at] != '}') {
    int id = 0;
    const size_t digits = at;
    for (; at < text.size() && text[at] >= '0' && text[at] <= '9' && at - digits < 6; ++at)
      id = 10 * id + (text[at] - '0');
    if (at == digits) return {};
    skip(" :");
    if (at >= text.size() || (text[at] != '\'' && text[at] != '"')) return {};
    const char quote = text[at++];
    std::string name;
    for (; at < text.size() && text[at] != quote; ++at) {
      if (text[at] == '\\' && at + 1 < text.size()) ++at;
      name += text[at];
    }
    if (at++ >= text.size()) return {};
    names[id] = name;
    skip(" ,");
  }
  return names;
}

}  // namespace oaslam
