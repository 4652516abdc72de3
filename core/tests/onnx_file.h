#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

// Writes small ONNX files: protobuf messages (protobuf.dev, "Encoding") with the field numbers of
// onnx.proto3 (github.com/onnx/onnx, Apache-2.0).
namespace oaslam::testing {

inline std::string Varint(uint64_t value) {
  std::string bytes;
  for (; value >= 128; value >>= 7) bytes += static_cast<char>((value & 127) | 128);
  return bytes + static_cast<char>(value);
}

// A field of bytes, and one of a number.
inline std::string Bytes(uint64_t id, const std::string& content) {
  return Varint(id << 3 | 2) + Varint(content.size()) + content;
}
inline std::string Number(uint64_t id, uint64_t value) { return Varint(id << 3) + Varint(value); }

// A dimension of a tensor, of known size or open.
inline std::string Dimension(uint64_t size) { return Number(1, size); }
inline std::string Dimension(const std::string& name) { return Bytes(2, name); }

// A tensor of floats, as input (field 11 of a graph) or as output (12).
inline std::string GraphEnd(uint64_t id, const std::string& name,
                            const std::vector<std::string>& dimensions) {
  std::string shape;
  for (const std::string& dimension : dimensions) shape += Bytes(1, dimension);
  return Bytes(id, Bytes(1, name) + Bytes(2, Bytes(1, Number(1, 1) + Bytes(2, shape))));
}

inline std::string Node(const std::string& operation, const std::vector<std::string>& inputs,
                        const std::string& output, const std::string& attributes = "") {
  std::string node;
  for (const std::string& input : inputs) node += Bytes(1, input);
  return Bytes(1, node + Bytes(2, output) + Bytes(4, operation) + attributes);
}

inline std::string IntAttribute(const std::string& name, uint64_t value) {
  return Bytes(5, Bytes(1, name) + Number(3, value) + Number(20, 2));
}

inline std::string IntsAttribute(const std::string& name, const std::vector<uint64_t>& values) {
  std::string list;
  for (const uint64_t value : values) list += Number(8, value);
  return Bytes(5, Bytes(1, name) + list + Number(20, 7));
}

// A constant tensor; without dimensions a scalar.
inline std::string Constant(const std::string& name, const std::vector<uint64_t>& dimensions,
                            const std::vector<float>& values) {
  std::string tensor, raw;
  for (const uint64_t size : dimensions) tensor += Number(1, size);
  for (const float value : values)
    for (int shift = 0; shift < 32; shift += 8)
      raw += static_cast<char>(std::bit_cast<uint32_t>(value) >> shift);
  return Bytes(5, tensor + Number(2, 1) + Bytes(8, name) + Bytes(9, raw));
}
inline std::string IntConstant(const std::string& name, const std::vector<uint64_t>& dimensions,
                               const std::vector<uint64_t>& values) {
  std::string tensor, packed;
  for (const uint64_t size : dimensions) tensor += Number(1, size);
  for (const uint64_t value : values) packed += Varint(value);
  return Bytes(5, tensor + Number(2, 7) + Bytes(7, packed) + Bytes(8, name));
}

// A file with this graph (operator set 13) and metadata.
inline std::string OnnxFile(const std::string& graph, const std::string& key = "",
                            const std::string& value = "") {
  const std::string metadata = key.empty() ? "" : Bytes(14, Bytes(1, key) + Bytes(2, value));
  return Number(1, 8) + Bytes(8, Number(2, 13)) + Bytes(7, Bytes(2, "graph") + graph) + metadata;
}

}  // namespace oaslam::testing
